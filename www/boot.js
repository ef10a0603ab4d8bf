// Starts the viewer. A classic script in the head, because the chosen theme must stand before the first paint; the
// module itself is imported when the page has been parsed.
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
  if (THEMES.includes(theme)) document.documentElement.dataset.theme = theme;

  const fail = (title, text) => {
    const box = document.getElementById("boot");
    if (!box) return;
    box.dataset.state = "failed";
    document.getElementById("boot-title").textContent = title;
    document.getElementById("boot-text").textContent = text;
    document.getElementById("status").textContent = `${title}. ${text}`;
    const retry = document.createElement("button");
    retry.type = "button";
    retry.className = "button";
    retry.textContent = "Reload";
    retry.addEventListener("click", () => location.reload());
    box.append(retry);
  };

  const start = async () => {
    if (typeof WebAssembly !== "object") {
      fail("This browser is too old", "The viewer needs WebAssembly.");
      return;
    }
    try {
      const viewer = await import("./semascan_viewer.js");
      await viewer.default();
      const page = viewer.start();
      // A hook for the browser tests: loses the connection as a broken network would.
      window.semascanTest = { cutLink: () => page.cut_link() };
    } catch (error) {
      console.error(error);
      fail("The viewer could not be loaded", String(error?.message ?? error));
    }
  };

  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start, { once: true });
  else start();
})();
