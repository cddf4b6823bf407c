// The page's words: the list of datasets, and what the manifest states about the one shown.
const element = (id) => document.getElementById(id);

export function say(text, kind = "") {
  element("message").textContent = text;
  element("message").className = kind;
}

const label_of = (dataset) => dataset.title || dataset.name || dataset.id;

export function fill_dataset_list(datasets, chosen_id, on_choose) {
  const list = element("datasets");
  list.replaceChildren(...datasets.map((dataset) => {
    const suffix = dataset.state && dataset.state !== "ready" ? ` (${dataset.state})` : "";
    return new Option(label_of(dataset) + suffix, dataset.id, false, dataset.id === chosen_id);
  }));
  list.onchange = () => on_choose(list.value);
}

const metres = (value) => (value >= 100 ? value.toFixed(0) : value >= 10 ? value.toFixed(1) : value.toFixed(2)) + " m";

function level_row(level) {
  const row = document.createElement("tr");
  const cells = [level.level, level.tiles.toLocaleString("en"), level.triangles.toLocaleString("en"),
    (level.composed ? "≤ " : "") + metres(level.stated_max_error), level.rmse === undefined ? "–" : metres(level.rmse)];
  for (const text of cells) row.insertCell().textContent = text;
  return row;
}

export function show_manifest(manifest) {
  const source = manifest.source || {};
  element("title").textContent = label_of(manifest);
  element("facts").textContent = [
    `${source.columns} × ${source.rows} pixels`, source.crs, `heights from ${source.vertical_datum} (${source.vertical_datum_from})`,
    `${manifest.triangles.toLocaleString("en")} triangles in ${manifest.tiles.toLocaleString("en")} tiles`].filter(Boolean).join(" · ");
  element("levels").replaceChildren(...manifest.levels.map(level_row));
  element("attribution").textContent = manifest.attribution || "";
  element("details").hidden = false;
}

export function on_controls({ tint, wireframe, home }) {
  element("tint").onchange = (event) => tint(event.target.checked);
  element("wireframe").onchange = (event) => wireframe(event.target.checked);
  element("home").onclick = home;
}

export function show_position(text) {
  element("position").textContent = text;
}
