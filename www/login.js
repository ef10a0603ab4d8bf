// Logs in, with a password or at the identity provider where there is one, and out. After a login the page goes back to where it
// was asked for: to a page of this agent and nowhere else.
import { offerLanguages, speak, t } from "./messages.js";

const ready = speak();

const ROLES = {
  viewer: () => t("role.viewer"),
  reviewer: () => t("role.reviewer"),
  operator: () => t("role.operator"),
  admin: () => t("role.admin"),
};
const element = (id) => document.getElementById(id);
const said = element("said");
const HEADERS = { "content-type": "application/json", "x-semascan-request": "1" };

// Where to go after a login. An address elsewhere, however it is written, has another origin.
const destination = () => {
  const asked = new URLSearchParams(location.search).get("next") ?? "./";
  try {
    const there = new URL(asked, location.href);
    return there.origin === location.origin && !there.pathname.endsWith("/login.html") ? there.href : "./";
  } catch {
    return "./";
  }
};

// What a refusal says, in words.
const reason = async (answer) => {
  try {
    return (await answer.json()).detail ?? t("link.agent_answered", { status: answer.status });
  } catch {
    return t("link.agent_answered", { status: answer.status });
  }
};

const say = (text) => {
  said.textContent = text && text[0].toUpperCase() + text.slice(1) + (text.endsWith(".") ? "" : ".");
};

element("login").addEventListener("submit", async (event) => {
  event.preventDefault();
  const password = element("password");
  element("submit").disabled = true;
  say("");
  await ready;
  try {
    const body = JSON.stringify({ name: element("name").value.trim(), password: password.value });
    const answer = await fetch("api/v1/login", { method: "POST", headers: HEADERS, body, cache: "no-store" });
    if (answer.ok) {
      location.replace(destination());
      return;
    }
    say(await reason(answer));
    password.value = "";
    password.focus();
  } catch {
    say(t("link.unreachable"));
  } finally {
    element("submit").disabled = false;
  }
});

// The provider sends the browser back to the agent, which sends it on to the path that is named here.
element("provider").addEventListener("click", async () => {
  element("provider").disabled = true;
  say("");
  await ready;
  try {
    const there = new URL(destination(), location.href);
    const body = JSON.stringify({ next: there.pathname + there.search + there.hash });
    const answer = await fetch("api/v1/oidc", { method: "POST", headers: HEADERS, body, cache: "no-store" });
    if (answer.ok) {
      location.assign((await answer.json()).location);
      return;
    }
    say(await reason(answer));
  } catch {
    say(t("link.unreachable"));
  }
  element("provider").disabled = false;
});

element("logout").addEventListener("click", async () => {
  await ready;
  try {
    const answer = await fetch("api/v1/logout", { method: "POST", headers: HEADERS, body: "{}", cache: "no-store" });
    // Who is nobody already is logged out, too.
    if (answer.ok || answer.status === 401) location.replace("login.html");
    else say(await reason(answer));
  } catch {
    say(t("link.unreachable"));
  }
});

// Whether people log in at an identity provider, too.
fetch("api/v1/login", { cache: "no-store" })
  .then(async (answer) => {
    await ready;
    const { provider } = answer.ok ? await answer.json() : {};
    if (!provider) return;
    element("provider").textContent = t("login.provider", { provider });
    element("elsewhere").hidden = !element("known").hidden;
  })
  .catch(() => say(t("link.unreachable")));

// Who is logged in already sees that.
fetch("api/v1/me", { cache: "no-store" })
  .then(async (answer) => {
    await ready;
    if (!answer.ok) return;
    const me = await answer.json();
    element("login").hidden = true;
    element("elsewhere").hidden = true;
    element("known").hidden = false;
    element("logout").hidden = !me.login;
    element("who").textContent = me.login ? t("login.who", { name: me.name, role: ROLES[me.role]?.() ?? me.role }) : t("login.nobody");
  })
  .catch(() => say(t("link.unreachable")));

offerLanguages(element("languages"));
