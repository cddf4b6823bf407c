// What every client's page does: it knows its dataset by its own address, shows the token of this tab, and follows a build.
const dataset = new URL("..", location.href).href.slice(0, -1), id = dataset.split("/").at(-1);
const element = (name) => document.getElementById(name);
const say = (text) => { element("message").textContent = text; };

const kClients = {
  cesium: "CesiumJS", threejs: "three.js", deckgl: "deck.gl", maplibre: "MapLibre GL", openlayers: "OpenLayers", leaflet: "Leaflet", qgis: "QGIS",
};
const here = location.pathname.split("/").at(-1).replace(".html", "");
element("client").replaceChildren(...Object.entries(kClients).map(([name, words]) => new Option(words, name, false, name === here)));
element("clients").onsubmit = (event) => {
  event.preventDefault();
  location.href = `${element("client").value}.html`;
};
element("viewer").href += `?dataset=${encodeURIComponent(id)}`;

// The viewer's own token: this tab's, where no other site can read it.
const kKey = "cordillera-token";
const token = sessionStorage.getItem(kKey), headers = token ? { Authorization: `Bearer ${token}` } : {};
element("token").onsubmit = (event) => {
  event.preventDefault();
  sessionStorage.setItem(kKey, new FormData(event.target).get("token").trim());
  location.reload();
};

// A dataset that is asleep is made again for whoever reads it, and has to be waited for.
async function fetch_json(path) {
  const response = await fetch(`${dataset}/${path}`, { headers }), wait_s = Number(response.headers.get("Retry-After"));
  if (response.status === 503 && wait_s > 0) {
    await new Promise((then) => setTimeout(then, 1000 * wait_s));
    return fetch_json(path);
  }
  const body = await response.json().catch(() => ({}));
  if (response.ok) return body;
  element("token").hidden = ![401, 403, 404].includes(response.status);
  say(body.detail || `${path}: HTTP ${response.status}`);
  throw new Error(body.detail || `${path}: HTTP ${response.status}`);
}

// Pictures that the dataset names to lie on it, in place of the service's own relief: an address with {z}, {x} and {y}, or nothing. It may be of
// another host, which is shown no token. Photographs are finer than heights.
const kFinerImagery = 3;
const imagery = () => manifest.options?.imagery;
const headers_for = (url) => (new URL(url, location.href).href.startsWith(`${dataset}/`) ? headers : {});

// A picture as an address of this page's own, for clients that cannot show a token for a picture.
async function picture_of(url) {
  const response = await fetch(url, { headers });
  if (!response.ok) throw new Error(`${url}: HTTP ${response.status}`);
  return URL.createObjectURL(await response.blob());
}

// Server-sent events, read with the token: hear(name, data), until the build is over. A stream that breaks off is asked for again, as where the
// service starts anew. A refusal ends it.
const kAgain_ms = 3000;
async function listen(hear) {
  let open = true;
  const hear_one = (name, data) => {
    open = !["ready", "failed"].includes(name);
    hear(name, data);
  };
  while (open) {
    const has_events = await read_events(hear_one).catch(() => true);
    if (!has_events) return;
    if (open) await new Promise((then) => setTimeout(then, kAgain_ms));
  }
}

async function read_events(hear) {
  const response = await fetch(`${dataset}/events`, { headers });
  if (!response.ok) return response.status === 429 || response.status >= 500;
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    const events = (text + value).split("\n\n");
    text = events.pop();
    for (const event of events) hear(/^event: (.*)$/m.exec(event)?.[1], JSON.parse(/^data: (.*)$/m.exec(event)?.[1] ?? "{}"));
  }
  return true;
}

// West, south, east and north of the data in degrees: east of the antimeridian they go on beyond 180. Then its lowest and its highest place, in
// metres above the ellipsoid: a camera that counts from the ellipsoid itself would stand in high ground.
function bounds_of({ bounds: [west, south, east, north, low, high] }) {
  return [west, south, east < west ? east + 360 : east, north, low, high];
}

let manifest = null, formats = [];  // formats: what the dataset has; all of them, but for folders and archives of finished tiles
let progress = {};  // what was last told of the build
function show_manifest(read) {
  manifest = read;
  document.title = `${read.title || read.name || id} · ${kClients[here]}`;
  element("attribution").textContent = read.attribution || "";
  say(read.provisional ? first_look() : "");
}

// Of a lazy dataset nobody knows an end, but what is made of it.
function first_look() {
  const { stage, share, build } = progress, words = "A first look: finer tiles", percent = (part) => `${Math.floor(100 * part)} %`;
  if (build === "lazy") return `${words} are made where you look. ${percent(manifest.done_blocks?.share ?? 0)} of the terrain is made so far.`;
  return `${words} take its place when the build is done.${share > 0 ? ` ${stage}, ${percent(share)}` : ""}`;
}

// Calls reload() whenever other tiles stand at the addresses that were read: finer provisional ones, those of blocks that are done, then the
// final ones. Those that come while it loads are read together afterwards.
async function follow(reload) {
  let turn = Promise.resolve(), due = false;
  const known = ({ provisional, levels, tiles }) => `${provisional} ${levels.at(-1).level} ${tiles}`;
  let seen = known({ provisional: true, levels: [{ level: manifest.max_level }], tiles: manifest.tiles });
  await listen((name, data) => {
    if (name === "progress") progress = data;
    if (name === "progress" && manifest.provisional) say(first_look());
    if (name === "failed") say(data.detail || "The build failed.");
    if (name !== "tiles" || known(data) === seen) return;
    seen = known(data);
    if (due) return;
    due = true;
    turn = turn.then(async () => {
      due = false;
      show_manifest(await fetch_json("manifest.json"));
      await reload();
      document.body.dataset.tiles = manifest.provisional ? "provisional" : "final";
    });
  });
  await turn;
}

// The dataset, as soon as there is something of it to be seen; then show() and, while it is being built, reload().
async function start({ show, reload }) {
  const status = await fetch_json("../" + id);
  if (status.state !== "ready" && !status.provisional && !status.asleep && status.state !== "failed") {
    say("Nothing can be seen yet.");
    await new Promise((seen) => listen((name) => { if (["tiles", "ready", "failed"].includes(name)) seen(); }));
  }
  if (status.asleep) say("Nobody has looked at this dataset for long. It is made again.");
  progress = { build: status.build };
  const read = await fetch_json("manifest.json");
  formats = (status.faces ?? (await fetch_json("../" + id)).faces ?? []).map(({ name }) => name);
  show_manifest(read);
  await show();
  document.body.dataset.tiles = manifest.provisional ? "provisional" : "final";
  if (manifest.provisional) await follow(reload);
}
