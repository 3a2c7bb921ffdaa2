// Search: Sphinx's weights; pages of decisions and changes come after all others.
var Scorer = {
    score: ([docname, , , , score]) => score - (/^(decisions\/|changes$)/.test(docname) ? 100 : 0),
    objNameMatch: 11, objPartialMatch: 6, objPrio: { 0: 15, 1: 5, 2: -5 }, objPrioDefault: 0,
    title: 15, partialTitle: 7, term: 5, partialTerm: 2,
};
