// What the address names: the dataset and the look in the query, the camera behind the #. What is as it is at first is left out.
const kControls = {  // name in the address: [element, property]
  look: ["look", "value"], ramp: ["ramp", "value"], imagery: ["imagery", "value"], heights: ["exaggeration", "value"], detail: ["detail", "value"],
  seen_from: ["viewshed-place", "value"], eyes: ["viewshed-eye", "value"], radius: ["viewshed-radius", "value"],
  triangles: ["wireframe", "checked"], borders: ["borders", "checked"],
};
const element = (id) => document.getElementById(id);
const first = {};
const shown = (value) => (typeof value === "boolean" ? (value ? "1" : "0") : value);

export const named = (name) => new URLSearchParams(window.location.search).get(name);
export const camera_named = () => window.location.hash.slice(1);

// Puts what the address names into the page's controls. To be called once, before anybody reads them.
export function read_link() {
  for (const [name, [id, property]] of Object.entries(kControls)) first[name] = element(id)[property];
  read_named();
}

// The same, where somebody has gone back to an address.
export function read_named() {
  for (const [name, [id, property]] of Object.entries(kControls)) {
    const control = element(id), wanted = named(name);
    if (wanted === null) {
      control[property] = first[name];
      continue;
    }
    const before = control[property];
    if (id === "ramp") control.append(new Option(wanted, wanted));  // its choices are known with the look
    control[property] = typeof before === "boolean" ? wanted === "1" : wanted;
    if (control.selectedIndex < 0) control[property] = before;  // a look, or a radius, that there is not
  }
}

// What a control has at first depends on the dataset. What the address does not name is as it is at first, and goes with it.
export function begin_with(name, value) {
  const [id, property] = kControls[name];
  if (named(name) === null) element(id)[property] = value;
  first[name] = value;
}

// changes: dataset, camera; what is not named stays. dataset: null names none. Another dataset than the one before is a page to come back to.
export function write_link(changes = {}) {
  const url = new URL(window.location.href), before = named("dataset");
  if (changes.dataset) url.searchParams.set("dataset", changes.dataset);
  else if (changes.dataset === null) url.searchParams.delete("dataset");
  for (const [name, [id, property]] of Object.entries(kControls)) {
    const value = element(id)[property];
    if (value === first[name] || value === "") url.searchParams.delete(name);
    else url.searchParams.set(name, shown(value));
  }
  if (changes.dataset !== undefined || changes.camera !== undefined) url.hash = changes.camera || "";
  const another = changes.dataset && before && before !== changes.dataset;
  window.history[another ? "pushState" : "replaceState"](null, "", url);
}
