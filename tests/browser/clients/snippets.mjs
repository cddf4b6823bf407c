// What a page of the documents tells its reader to do, exactly as they would copy it.
import { readFileSync } from "node:fs";

const kShown = { dataset: "http://127.0.0.1:8080/v1/datasets/ID", archives: "http://127.0.0.1:8000/" };

// A reader puts their own addresses in place of those that are shown; nothing else changes.
export function with_addresses(code, addresses) {
  return Object.entries(kShown).reduce((text, [name, shown]) => text.replaceAll(shown, addresses[name]), code);
}

// The one block of a language; more than one or none is an error of the document.
function block(text, language, where) {
  const blocks = [...text.matchAll(new RegExp(`^\`\`\`${language}\n([\\s\\S]*?)^\`\`\`$`, "gm"))];
  if (blocks.length !== 1) throw new Error(`${where} has ${blocks.length} blocks of ${language}, not one`);
  return blocks[0][1];
}

// The block of js in a section, or in the whole document.
export function snippet_of(document, section) {
  const text = readFileSync(document, "utf8");
  const start = section ? text.indexOf(`\n## ${section}\n`) : 0;
  if (start < 0) throw new Error(`${document} has no section "${section}"`);
  const end = section ? text.indexOf("\n## ", start + 1) : -1;
  const where = section ? `${document}, section "${section}",` : document;
  const code = block(text.slice(start, end < 0 ? undefined : end), "js", where);
  if (!Object.values(kShown).some((shown) => code.includes(shown))) throw new Error(`the block of ${where} shows no known address`);
  return code;
}

// The block of js in a document that speaks of something, without addresses in it.
export function block_of(document, word) {
  const all = readFileSync(document, "utf8").matchAll(/^```js\n([\s\S]*?)^```$/gm);
  const blocks = [...all].filter(([, code]) => code.includes(word));
  if (blocks.length !== 1) throw new Error(`${document} has ${blocks.length} blocks of js with ${word}, not one`);
  return blocks[0][1];
}

// The HTML of a document, and what it says to copy beside the page: {"cesium/": "cesium/Build/Cesium"}, from packages.
export function page_of(document) {
  const text = readFileSync(document, "utf8");
  const copies = [...text.matchAll(/^ {4}cp -r node_modules\/(\S+) (\S+)$/gm)];
  return { html: block(text, "html", document), folders: Object.fromEntries(copies.map(([, from, to]) => [`${to}/`, from])) };
}
