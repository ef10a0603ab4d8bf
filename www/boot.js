// Starts the viewer. A classic script in the head, so that whatever fails from then on is said; the module itself is imported
// when the page has been parsed.
(() => {
  "use strict";

  // A text of this page: in English where no other has arrived.
  const t = (key, values = {}) => {
    const text = document.querySelector(`#words [data-message="${key}"]`)?.textContent ?? key;
    return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
  };

  // Says in place of the model that there will be none. The panels may be gone or dead: nothing of them is used.
  const fail = (title, text) => {
    if (document.documentElement.dataset.viewer === "failed") return;
    document.documentElement.dataset.viewer = "failed";
    const box = document.createElement("div");
    box.id = "failure";
    box.className = "message is-raised";
    box.dataset.state = "failed";
    box.setAttribute("role", "alert");
    const heading = document.createElement("h2");
    heading.textContent = title;
    const paragraph = document.createElement("p");
    paragraph.textContent = text;
    const retry = document.createElement("button");
    retry.type = "button";
    retry.className = "button";
    retry.textContent = t("common.reload");
    retry.addEventListener("click", () => location.reload());
    box.append(heading, paragraph, retry);
    document.getElementById("boot")?.remove();
    (document.querySelector(".viewport") ?? document.body).append(box);
    // What said that the viewer was at work does so no longer.
    const link = document.querySelector("[data-testid=connection]");
    if (link) {
      link.dataset.state = "broken";
      link.textContent = t("connection.broken");
    }
  };

  // A panic of the viewer, or memory that is not there, ends its module: whatever the page shows from then on is old. What
  // happened is in the console. Errors of other scripts, such as extensions, are none of its business.
  const onError = (error) => {
    if (error instanceof WebAssembly.RuntimeError) {
      fail(t("boot.stopped"), t("boot.stopped.text"));
    }
  };
  addEventListener("error", (event) => onError(event.error));
  addEventListener("unhandledrejection", (event) => onError(event.reason));

  // Who the agent takes this page's reader for; null where somebody must log in first, and where it does not say.
  const whoAmI = async () => {
    try {
      const answer = await fetch("api/v1/me", { cache: "no-store" });
      if (answer.status === 401) {
        // And back here after that.
        location.replace(`login.html?next=${encodeURIComponent(location.pathname + location.search + location.hash)}`);
        return { leaves: true };
      }
      return answer.ok ? await answer.json() : null;
    } catch {
      return null;
    }
  };

  // A login can end while the page is open: the stream then breaks off, and a browser does not say why. Whenever the page says
  // that it is not connected, it is asked whether somebody must log in.
  const followLogin = () => {
    let asking = false;
    const ask = async () => {
      const state = document.querySelector("[data-testid=connection]")?.dataset.state;
      if (asking || !state || state === "connected") return;
      asking = true;
      await whoAmI();
      asking = false;
    };
    const observer = new MutationObserver(ask);
    observer.observe(document.body, { subtree: true, attributes: true, attributeFilter: ["data-state"] });
  };

  // The way to the inspections that are kept, where some are.
  const showInspections = () => {
    const link = document.createElement("a");
    link.className = "text-button inspections-link";
    link.href = "inspections.html";
    link.textContent = t("inspections.title");
    document.getElementById("header")?.append(link);
  };

  // The way to the login's page, for those who have one.
  const showLogin = (me) => {
    const link = document.createElement("a");
    link.className = "text-button login-link";
    link.href = "login.html";
    link.textContent = me.name;
    link.title = t("login.logged_in", { name: me.name, role: t(`role.${me.role}`) });
    document.getElementById("header")?.append(link);
  };

  // A puck that moves the camera: what speaks with it is loaded when somebody asks for one, or has done so before.
  const followSpaceMouse = async () => {
    const connect = (ask) =>
      import("./space_mouse.js")
        .then((mouse) => mouse.connect(running, ask))
        .catch((error) => console.error(error));
    addEventListener("space-mouse", () => connect(true));
    const known = await navigator.hid?.getDevices().catch(() => []);
    if (known?.length) connect(false);
  };

  // Kept as long as the page: what is dropped stops.
  let running = null;

  const start = async () => {
    if (typeof WebAssembly !== "object") {
      fail(t("boot.old"), t("boot.old.text"));
      return;
    }
    try {
      const asked = whoAmI();
      const words = import("./messages.js").then((messages) => messages.spoken);
      const viewer = await import("./semascan_viewer.js");
      await viewer.default();
      const { language, file } = await words;
      if (file) viewer.speak(language, file);
      const me = await asked;
      if (me?.leaves) return;
      running = viewer.start();
      followSpaceMouse();
      if (me?.keeps) showInspections();
      if (me?.login) {
        showLogin(me);
        followLogin();
      }
    } catch (error) {
      console.error(error);
      fail(t("boot.not_loaded"), t("boot.not_loaded.text"));
    }
  };

  if (document.readyState === "loading") document.addEventListener("DOMContentLoaded", start, { once: true });
  else start();
})();
