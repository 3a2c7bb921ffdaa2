// What can be said against figures that stand in a page as SVG: texts that overlap, or reach past the figure's edge.
() => {
  const wrong = [];
  for (const figure of document.querySelectorAll("body > svg")) {
    const name = figure.dataset.name;
    const frame = figure.getBoundingClientRect();
    const texts = [...figure.querySelectorAll("text")].filter((t) => t.textContent.trim()).map((t) => {
      const box = t.getBoundingClientRect();
      const turned = box.height > 1.5 * box.width;
      // A line of text is as high as its font allows; letters fill less of it.
      const [x, y] = turned ? [0.2 * box.width, 0] : [0, 0.2 * box.height];
      return { said: t.textContent.trim(), left: box.left + x, right: box.right - x, top: box.top + y, bottom: box.bottom - y };
    });
    for (const t of texts) {
      if (t.left < frame.left - 1 || t.right > frame.right + 1 || t.top < frame.top - 1 || t.bottom > frame.bottom + 1) wrong.push(`${name}: “${t.said}” reaches past the edge`);
    }
    texts.forEach((a, i) => texts.slice(i + 1).forEach((b) => {
      const wide = Math.min(a.right, b.right) - Math.max(a.left, b.left);
      const high = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top);
      if (wide > 1 && high > 1) wrong.push(`${name}: “${a.said}” over “${b.said}”`);
    }));
  }
  return wrong;
}
