// The page's words and controls: the list of datasets, what failed, what goes on, and what the manifest states about the one shown.
import { words_of } from "./problem.js";
import { show, tell, tell_progress } from "./unseen.js";

const element = (id) => document.getElementById(id);

export function say(text, kind = "") {
  element("message").textContent = text;
  element("message").className = kind;
}

// How far the dataset is. It gives way to the words of a tool or of an error, unless it is over all, and comes back when a tool's are gone.
let state_words = "";
export function say_state(words, over_all = false) {
  const free = over_all || ["", state_words].includes(element("message").textContent);
  state_words = words;
  if (free) say(words);
}

// What is said of provisional tiles. lazy: blocks are made where people look.
export function first_look_words({ provisional, done_blocks }, lazy) {
  if (!provisional) return "";
  const made = `${Math.floor(100 * (done_blocks?.share ?? 0))} %`;
  return lazy ? `A first look: finer tiles are made where you look. ${made} of the terrain is made so far.`
    : "A first look: finer tiles take its place when the build is done.";
}

// Words that are not true any more, unless something else has been said since.
export const take_back = (words) => { if (element("message").textContent === words) say(state_words); };
export const take_back_all = () => say(state_words);

// Empty ones: what it has said is over.
let tool_words = "";
export function say_of_tool(words) {
  if (words) say(words);
  else take_back(tool_words);
  tool_words = words;
}
export function say_for(words, milliseconds) {
  say(words);
  setTimeout(() => take_back(words), milliseconds);
}

// Files that are no part of what was posted. It stays beside other words, until somebody adds, chooses or removes something.
export function say_left_out(words) {
  element("left-out").textContent = words;
}

// The page without its terrain: it stays for as long as the page does.
export function tell_no_globe() {
  document.body.classList.add("no-globe");
  element("no-globe").hidden = false;
  unfold(true);
}

export const label_of = (dataset) => dataset.title || dataset.name || dataset.id;
// Of two with one name, the end of the id tells which is which.
const labels_of = (datasets) => datasets.map((one) => {
  const label = label_of(one);
  return datasets.some((other) => other !== one && label_of(other) === label) ? `${label} · ${one.id.split("-").at(-1)}` : label;
});

function make(tag, text, properties = {}) {
  return Object.assign(document.createElement(tag), { textContent: text }, properties);
}

// Those that can be looked at, now or soon. Failed ones have a list of their own: there is nothing of them to choose.
export function fill_dataset_list(datasets, on_choose) {
  const list = element("datasets"), offered = datasets.filter(({ state }) => state !== "failed"), labels = labels_of(offered);
  list.replaceChildren(...offered.map((dataset, k) => {
    const state = dataset.asleep ? "asleep" : dataset.state, suffix = state && state !== "ready" ? ` (${state})` : "";
    return new Option(labels[k] + suffix, dataset.id);
  }));
  element("choice").hidden = list.options.length === 0;
  list.onchange = () => on_choose(list.value);
}

function failed_item(dataset, on_delete) {
  const item = make("li", "", { id: `failed-${dataset.id}` });
  const button = make("button", "delete", { type: "button", onclick: () => on_delete(dataset.id), ariaLabel: `Delete ${label_of(dataset)}` });
  item.append(make("strong", label_of(dataset)), " ", button, make("p", words_of({ title: "its build failed", ...dataset.error })));
  return item;
}

// on_delete(id): the server is to forget it.
export function fill_failed_list(datasets, on_delete) {
  const failed = datasets.filter(({ state }) => state === "failed"), list = element("failed-list");
  const focused = [...list.querySelectorAll("button")].indexOf(document.activeElement);
  show("failed", failed.length > 0, "add");
  element("failed-count").textContent = failed.length === 1 ? "1 upload failed" : `${failed.length} uploads failed`;
  list.replaceChildren(...failed.map((dataset) => failed_item(dataset, on_delete)));
  if (focused >= 0) [...list.querySelectorAll("button")].at(Math.min(focused, failed.length - 1))?.focus();
  show("failed-all", failed.length > 1, "failed-count");
  element("failed-all").onclick = () => failed.forEach(({ id }) => on_delete(id));
}

const metres = (value) => `${value >= 100 ? value.toFixed(0) : value >= 10 ? value.toFixed(1) : value.toFixed(2)} m`;
// Of provisional tiles nobody knows the errors: null.
const kNotKnown = "not known yet";

function level_row(level) {
  const row = document.createElement("tr");
  const cells = [level.level, level.tiles.toLocaleString("en"), level.triangles.toLocaleString("en"),
    level.tiles === 0 ? "–" : level.stated_max_error === null ? kNotKnown : (level.composed ? "≤ " : "") + metres(level.stated_max_error), (level.rmse ?? null) === null ? "–" : metres(level.rmse)];
  for (const text of cells) row.insertCell().textContent = text;
  return row;
}

function heights_text(source) {
  const {vertical_datum: used, vertical_datum_from: from, vertical_datum_declared: declared} = source;
  return `heights from ${used} (${from})${declared && declared !== used ? `, the raster declares ${declared}` : ""}`;
}

// Where users compare: the raster's own pixels. Stores of earlier versions do not know it.
function pixels_text(source) {
  const error = source.error_at_pixels;
  return error && `at most ${metres(error.max)} off the raster’s pixels, 99 % within ${metres(error.p99)}, RMSE ${metres(error.rmse)}`;
}

// What is stated of several rasters is the first one's.
function size_text(source, rasters) {
  if (rasters > 1) return `${rasters} rasters`;
  return source.columns > 0 && `${source.columns} × ${source.rows} pixels`;
}

// Names of files have no spaces to break a line at: behind a _ or a - it may end.
const breakable = (text) => text.split(/(?<=[_-])/).flatMap((part, k) => (k === 0 ? [part] : [make("wbr", ""), part]));

export function show_manifest(manifest) {
  const source = manifest.source || {}, { provisional } = manifest;
  element("title").replaceChildren(...breakable(label_of(manifest)));
  element("facts").textContent = [
    size_text(source, manifest.sources?.length), source.crs, heights_text(source), !provisional && pixels_text(source),
    `${provisional ? "first look: " : ""}${manifest.triangles.toLocaleString("en")} triangles in ${manifest.tiles.toLocaleString("en")} tiles`, ...(manifest.notes || []),
  ].filter(Boolean).join(" · ");
  element("levels").replaceChildren(...manifest.levels.map(level_row));
  element("attribution").textContent = manifest.attribution || "";
  element("details").hidden = false;
}

export function hide_manifest() {
  element("details").hidden = true;
}

function unfold(open) {
  element("panel").classList.toggle("folded", !open);
  element("fold").textContent = open ? "–" : "+";
  element("fold").setAttribute("aria-expanded", String(open));
  element("fold").title = open ? "fold the panel" : "unfold the panel";
  element("fold").ariaLabel = element("fold").title;
}

// Something in the panel that somebody has to see: whatever it lies in is opened.
export function bring_up(id) {
  unfold(true);
  for (let one = element(id); one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  element(id).scrollIntoView({ block: "nearest" });
}

// On a small window the panel starts folded: the terrain is what somebody came for.
export function start_folding() {
  unfold(!window.matchMedia("(max-width: 700px), (max-height: 480px)").matches);
  element("fold").onclick = () => unfold(element("panel").classList.contains("folded"));
  // On a phone the legend stands above the panel, which grows with its words.
  new ResizeObserver(([{ target }]) => document.documentElement.style.setProperty("--panel-height", `${target.offsetHeight}px`)).observe(element("panel"));
}

// Of the window: what the panel takes of its width, where it is open and leaves room for the terrain beside it, and what the tools take in their corner.
export function shares_taken() {
  const { innerWidth: width, innerHeight: height } = window, tools = element("tools").getBoundingClientRect();
  const beside = !element("panel").classList.contains("folded") && width > 1000;
  return {
    panel: beside ? element("panel").getBoundingClientRect().right / width : 0, tools: { width: (width - tools.left) / width, height: tools.bottom / height },
  };
}

const kLink_ms = 1500;

// Whether the text is in the clipboard. Over plain http from another machine a browser has no navigator.clipboard, but copies what is selected.
async function copied(text) {
  if (await navigator.clipboard?.writeText(text).then(() => true, () => false)) return true;
  const field = make("textarea", text, { readOnly: true }), had = document.activeElement;
  document.body.append(field);
  field.select();
  const done = document.execCommand("copy");
  field.remove();
  had?.focus();
  return done;
}

async function copy(from, button) {
  const before = button.textContent, done = await copied(from.textContent);
  if (!done) document.getSelection().selectAllChildren(from);
  button.textContent = done ? "copied" : "selected: copy it with the keys";
  tell(button.textContent);
  setTimeout(() => { button.textContent = before; }, kLink_ms);
}

// A button of an icon has no words to change: it takes another colour, and the title says what happened.
async function copy_link(text) {
  const button = element("link"), before = button.title, done = await copied(text);
  button.title = done ? "copied" : before;
  button.classList.toggle("done", done);
  say_for(done ? "The link to this view is copied." : "The browser does not let this page copy. The link to this view is the address in the browser’s bar.", 2 * kLink_ms);
  setTimeout(() => { button.title = before; button.classList.remove("done"); }, kLink_ms);
}

export const look = () => ({ look: element("look").value, imagery: element("imagery").value, ramp: element("ramp").value });

// Colours that the look may have; what an address named, stops among it, stays a choice. The first is the look's own: no name is sent.
export function fill_ramps(names, wanted) {
  const list = element("ramp");
  const choices = names.map((name, k) => new Option(name, k === 0 ? "" : name));
  if (names.length > 0 && wanted && !names.includes(wanted)) choices.push(new Option("as in the link", wanted));
  list.replaceChildren(...choices);
  list.value = wanted && names[0] !== wanted && names.length > 0 ? wanted : "";
  element("ramp-row").hidden = names.length === 0;
}

// Looks that a dataset cannot have stand in the list, but cannot be chosen. first: takes the place of one that an address names.
export function leave_out_looks(names, first) {
  for (const option of element("look").options) option.disabled = names.includes(option.value);
  if (names.includes(element("look").value)) element("look").value = first;
}

// error_px: the error of what is drawn, in pixels.
export const controls = () => ({
  wireframe: element("wireframe").checked, borders: element("borders").checked,
  exaggeration: Number(element("exaggeration").value), error_px: 2 ** Number(element("detail").value),
});

export function show_values() {
  element("exaggeration-value").textContent = element("exaggeration").value;
  element("detail-value").textContent = element("detail").ariaValueText = `${controls().error_px} px`;
  element("imagery-row").hidden = element("look").value !== "imagery";
}

// look(), controls(): something was changed. link(): the address to copy.
export function on_controls(on) {
  for (const id of ["look", "imagery", "ramp"]) element(id).onchange = () => { show_values(); on.look(id); };
  for (const id of ["wireframe", "borders", "exaggeration", "detail"]) element(id).oninput = () => { show_values(); on.controls(); };
  for (const id of ["home", "closer", "farther", "north", "tilt", "measure", "look-around", "rename", "delete"]) element(id).onclick = on[id];
  element("link").onclick = () => copy_link(on.link());
  show_values();
}

export function show_snippets(snippets) {
  const list = element("client"), chosen = Math.max(list.selectedIndex, 0);
  const show = () => { element("snippet").textContent = snippets[list.selectedIndex].text; };
  list.replaceChildren(...snippets.map(({ client }, k) => new Option(client, String(k), false, k === chosen)));
  list.onchange = show;
  element("copy-snippet").onclick = () => copy(element("snippet"), element("copy-snippet"));
  show();
}

const kDemos = { cesium: "CesiumJS", threejs: "three.js", deckgl: "deck.gl", maplibre: "MapLibre", openlayers: "OpenLayers", leaflet: "Leaflet", qgis: "QGIS" };
export function show_demos(base) {
  element("demos").replaceChildren(...Object.entries(kDemos).map(([name, words]) => make("a", words, { href: `${base}/demo/${name}.html` })));
}

// Only of what lies in the service itself: what is mounted can neither be renamed nor deleted there.
export function offer_changes(offered) {
  for (const id of ["rename", "delete"]) show(id, offered, "datasets");
}

// A button that stays pressed.
export function press(id, on) {
  element(id).setAttribute("aria-pressed", String(Boolean(on)));
}

export function select_dataset(id) {
  element("datasets").value = id ?? "";
}

// share: 0 to 1, or null while nobody knows. Without words the work is over. cancel(): ends it, where this page may.
export function show_progress(share, words, cancel) {
  show("cancel", cancel && words, "fold");
  element("going").hidden = !words;
  tell_progress(share, words);
  element("cancel").onclick = cancel ?? null;
  if (!words) return;
  if (share === null) element("share").removeAttribute("value");
  else element("share").value = share;
  element("stage").textContent = words;
}

export function show_loading(on) {
  element("loading").hidden = !on;
}

let drawn = "";
export function show_drawn(triangles, bytes) {
  const text = `${triangles.toLocaleString("en")} triangles on screen · ${(bytes / 1e6).toFixed(1)} MB fetched`;
  if (text === drawn) return;
  drawn = text;
  element("drawn").textContent = text;
}

const side = (degrees, [positive, negative]) => `${Math.abs(degrees).toFixed(5)}° ${degrees < 0 ? negative : positive}`;

// place: as globe.js gives it, or null. sea: a SeaLevel, for the height that people know. Gives the words.
export function show_position(place, manifest, sea) {
  const words = { "place": "", "sea-height": "", "ellipsoid-height": "", "place-error": "" };
  if (place) {
    const { longitude, latitude, height } = place;
    const level = manifest.levels.find(({ level: number }) => number === place.level);
    const undulation = sea.undulation_at(longitude, latitude);
    words.place = `${side(latitude, "NS")}, ${side(longitude, "EW")}`;
    if (undulation !== undefined) words["sea-height"] = `${(height - undulation).toFixed(1)} m above sea level (${sea.name})`;
    words["ellipsoid-height"] = `${height.toFixed(1)} m above the ellipsoid`;
    if (level) words["place-error"] = `${level.stated_max_error === null ? `error ${kNotKnown}` : `± ${metres(level.stated_max_error)}`} (level ${place.level})`;
  }
  for (const [id, text] of Object.entries(words)) element(id).textContent = text;
  return Object.values(words).filter(Boolean).join(", ");
}

export function show_heading(heading_rad) {
  element("needle").style.transform = `rotate(${-heading_rad}rad)`;
}
