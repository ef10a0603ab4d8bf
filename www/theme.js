// The chosen theme and the layout, before the first paint. The theme is that of the address (`?theme=dark`), else the one that was chosen before. A classic
// script in the head, because modules wait for the page.
(() => {
  "use strict";

  const THEMES = ["system", "light", "dark"];
  const asked = new URLSearchParams(location.search).get("theme");
  let theme = THEMES.includes(asked) ? asked : null;
  try {
    theme ??= localStorage.getItem("semascan.theme");
  } catch {
    // Storage may be forbidden; the system's theme is a good one.
  }
  // A page that shows several has room for the model alone.
  if (new URLSearchParams(location.search).has("pane")) document.documentElement.dataset.pane = "";
  if (THEMES.includes(theme)) document.documentElement.dataset.theme = theme;
})();
