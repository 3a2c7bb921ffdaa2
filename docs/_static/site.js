// The theme's toggles of the navigation are arrows without a name: each gets that of the page beside it.
document.addEventListener("DOMContentLoaded", () => {
    for (const toggle of document.querySelectorAll(".bd-sidebar details > summary")) {
        const page = toggle.closest("li")?.querySelector("a")?.textContent.trim();
        if (page && !toggle.textContent.trim()) toggle.setAttribute("aria-label", `Pages under ${page}`);
    }
});
