// The page's words in the language of the person. English stands in the pages and in messages/en.json; another language is one
// file beside it and one line in messages/languages.json. The viewer looks its texts up itself (viewer/src/words) and gets the
// file of its language from boot.js.

const KEY = "semascan.language";

// Attributes that hold words, by the name of the attribute that holds their key.
const ATTRIBUTES = { label: "aria-label", title: "title", placeholder: "placeholder" };

let messages = {};

/** What is spoken: the language's code, all languages there are (code to own name), and its file, empty for English. */
export const spoken = (async () => {
  try {
    const languages = JSON.parse(await read("languages"));
    const language = choice(languages);
    const file = language === "en" ? "" : await read(language);
    document.documentElement.lang = language;
    messages = file ? JSON.parse(file) : {};
    fill();
    return { language, languages, file };
  } catch (error) {
    console.warn("The page stays English.", error);
    return { language: "en", languages: { en: "English" }, file: "" };
  }
})();

async function read(name) {
  const answer = await fetch(`messages/${name}.json`, { cache: "no-cache" });
  if (!answer.ok) throw new Error(`messages/${name}.json: ${answer.status}`);
  return answer.text();
}

/** What the address asks for, else what was chosen before, else what the browser prefers. */
function choice(languages) {
  const known = (code) => Object.hasOwn(languages, code);
  const asked = new URLSearchParams(location.search).get("language");
  if (asked !== null) return known(asked) ? asked : "en";
  try {
    const chosen = localStorage.getItem(KEY);
    if (chosen !== null && known(chosen)) return chosen;
  } catch {
    // Storage may be forbidden; the browser's language is a good one.
  }
  return navigator.languages.map((own) => own.toLowerCase().split("-")[0]).find(known) ?? "en";
}

/** Puts the words into the elements that name a key. */
function fill() {
  for (const element of document.querySelectorAll("[data-message]")) {
    element.textContent = messages[element.dataset.message] ?? element.textContent;
  }
  for (const [name, attribute] of Object.entries(ATTRIBUTES)) {
    for (const element of document.querySelectorAll(`[data-message-${name}]`)) {
      const text = messages[element.getAttribute(`data-message-${name}`)];
      if (text !== undefined) element.setAttribute(attribute, text);
    }
  }
}

/** For pages whose scripts make texts: gets English, too. When it is there, `t` knows every key. */
export async function speak() {
  const english = read("en");
  await spoken;
  try {
    messages = { ...JSON.parse(await english), ...messages };
  } catch (error) {
    console.warn("Texts are missing.", error);
  }
}

/** The text of a key with its `{placeholders}` filled; `count` decides between singular and plural. */
export function t(key, values = {}) {
  const message = messages[key] ?? key;
  const text = typeof message === "string" ? message : String(values.count) === "1" ? message.one : message.other;
  return text.replace(/\{(\w+)\}/g, (_, name) => values[name] ?? "");
}

/** A number with that many decimals, or with what `options` of Intl say. */
export function figure(value, options) {
  const digits = typeof options === "number" ? { minimumFractionDigits: options, maximumFractionDigits: options } : options;
  return value.toLocaleString(document.documentElement.lang, { useGrouping: false, ...digits });
}

/** Day and time, as the person's country writes them where it speaks the page's language. */
export function time(date) {
  const language = document.documentElement.lang;
  return date.toLocaleString(navigator.languages.find((own) => own.split("-")[0] === language) ?? language);
}

/** Puts a button for each language into `place`. */
export async function offerLanguages(place) {
  const { language, languages } = await spoken;
  for (const [code, name] of Object.entries(languages)) {
    const button = document.createElement("button");
    Object.assign(button, { type: "button", className: "text-button", textContent: name, lang: code });
    button.setAttribute("aria-pressed", String(code === language));
    button.addEventListener("click", () => choose(code));
    place.append(button);
  }
}

/** Keeps the choice and loads the page again. What the address asks for counts more, so it asks for nothing then. */
function choose(code) {
  const address = new URL(location.href);
  address.searchParams.delete("language");
  try {
    localStorage.setItem(KEY, code);
  } catch {
    // Where nothing is kept, the address has to ask.
    address.searchParams.set("language", code);
  }
  if (address.href === location.href) location.reload();
  else location.replace(address);
}
