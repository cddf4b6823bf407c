// The viewer: one dataset's tileset on a globe. Every address is relative, so a path prefix or a proxy changes nothing.
import * as builds from "./builds.js";
import { delete_dataset, is_to_go, rename } from "./change.js";
import * as panel from "./dataset_panel.js";
import { Draft } from "./draft.js";
import {
  camera_numbers, data_sphere, draw_after_moves, face_north, fly_home, kCloser, make_globe, metres_a_pixel, outline, set_camera, show_earth, stay_above, tilt, zoom,
} from "./globe.js";
import { steer_by_keys } from "./keyboard.js";
import { hide_legend, show_scale } from "./legend.js";
import { camera_named, named, read_link, read_named, write_link } from "./link_state.js";
import { LookChoice } from "./look_choice.js";
import { kPictures, kShadedRelief, Looks } from "./looks.js";
import { is_loaded, preloaded } from "./preload.js";
import { News } from "./news.js";
import { hide_welcome, show_welcome } from "./sample.js";
import { base_of, fetched_bytes, fetch_json, newest_datasets, tiles_of } from "./service.js";
import { SeaLevel } from "./sea_level.js";
import { snippets_for } from "./snippets.js";
import { relief_light } from "./terrain_style.js";
import { asked_by_cesium, take_token } from "./token.js";
import { Tools } from "./tools.js";
import { tell } from "./unseen.js";
import { take_files } from "./upload.js";

const Cesium = window.Cesium;

// What tests and the console may look at. id: of the dataset that is shown. The manifest of a folder may have another one.
const page = (window.cordillera = {
  widget: null, scene: null, tileset: null, id: null, version: undefined, manifest: null, datasets: [], error: null, tilesLoaded: false, looks: null });

// What the page shows or waits for, as somebody chose it: its id, the version of which it was told, whether its blocks are made where people look, its name.
const wanted = { id: null, version: undefined, lazy: false, label: "" };

function report(error) {
  page.error = String(error.message || error);
  panel.say(page.error, "problem");
  if (error.silent) news.wait();
}

const look_choice = new LookChoice(page);

const first_look = () => panel.first_look_words(page.manifest, wanted.lazy);
const home = () => (page.manifest ? fly_home(page.scene, page.manifest.bounds, panel.shares_taken()) : show_earth(page.scene.camera));

// on: the page, or a tileset that is still to be shown, with its looks.
function apply_controls(on = page) {
  const { wireframe, borders, exaggeration, error_px } = panel.controls();
  on.tileset.debugWireframe = wireframe;
  on.tileset.debugShowContentBoundingVolume = borders;
  on.tileset.maximumScreenSpaceError = error_px;
  on.looks.exaggerate(exaggeration);
  if (page.profile?.points) page.profile.draw_line();
  page.scene.requestRender();
}

// A folder or an archive of finished tiles that was built without 3D Tiles.
function no_meshes(base) {
  panel.show_demos(base);
  return new Error("It has no 3D Tiles, which this page shows. MapLibre, among the other clients here, shows heights, pictures and contours.");
}

// What stands in the place of terrain that is still to come: its outline, and a shimmer.
let placeholder = null;
function await_terrain(bounds) {
  if (placeholder) page.scene.primitives.remove(placeholder);
  placeholder = bounds ? page.scene.primitives.add(outline(bounds)) : null;
  page.scene.requestRender();
  panel.show_loading(Boolean(bounds));
}

// Later answers of an earlier call must not take the place of a later one's.
let showing = 0;

function tell_of(base, manifest) {
  panel.show_manifest(manifest);
  panel.show_demos(base);
  panel.show_snippets(snippets_for(new URL(base, document.baseURI).href));
}

// All that there is of a dataset where the browser draws none.
function show_words(id, manifest, words) {
  Object.assign(page, { id, version: wanted.version, manifest });
  hide_welcome();
  tell_of(base_of(id), manifest);
  panel.say_state([words, first_look()].filter(Boolean).join(" "), words !== "");
}

// words: what is said when it is shown.
async function show_dataset(id, words = "") {
  const base = base_of(id), turn = ++showing;
  const again = page.id === id;  // its other tiles take the place of those that are seen: neither flash nor flight
  if (!again) page.tilesLoaded = false;
  const manifest = await fetch_json(`${base}/manifest.json`, () => turn === showing);
  if (turn !== showing) return;
  if (!page.scene) return show_words(id, manifest, words);
  look_choice.begin(manifest);
  const { url, normal_maps } = await tiles_of(base, manifest, panel.look().look === kShadedRelief);
  const tileset = await Cesium.Cesium3DTileset.fromUrl(asked_by_cesium(url), { show: !again, enablePick: true, enableDebugWireframe: true })
    .catch((error) => { throw error.statusCode === 404 ? no_meshes(base) : error; });
  if (turn !== showing) return tileset.destroy();
  page.scene.primitives.add(tileset);
  if (!manifest.provisional) tileset.tileFailed.addEventListener((failed) => news.tell_of_tile(tileset, failed).catch(report));
  const looks = new Looks(page.scene, tileset, manifest, { base, normal_maps, on_failed: () => news.tell_of_picture(tileset).catch(report) });
  look_choice.begin(manifest, tileset.asset?.extras?.texture);
  look_choice.begin_detail(looks);
  const looked = look_choice.apply({ looks });
  apply_controls({ tileset, looks });
  const same = page.version === wanted.version && !page.manifest?.provisional;
  if (again) {
    looks.lay_over(page.looks.laid);
    await looked;  // tiles without their picture would count as loaded
    await preloaded(tileset, page.scene, () => turn === showing);
  }
  if (turn !== showing) return page.scene.primitives.remove(tileset);
  if (page.tileset) page.scene.primitives.remove(page.tileset);
  Object.assign(page, { id, version: wanted.version, manifest, tileset, looks, sea: new SeaLevel(base, () => tools.point_again()) });
  // A provisional tile may have gone with the others while it was on its way.
  if (!manifest.provisional) news.shown(tileset);
  hide_welcome();
  if (!again) await_terrain(manifest.bounds);
  page.scene.light = relief_light(data_sphere(manifest.bounds).center);
  page.scene.requestRender();
  tell_of(base, manifest);
  if (!again) tools.stop();
  else if (page.viewshed.place && !same) page.viewshed.take(page.viewshed.place);  // from other heights
  if (!again && !set_camera(page.scene.camera, camera_named())) home();
  panel.say_state([words, first_look()].filter(Boolean).join(" "), words !== "");
}

// What is on its way to the page: of which dataset, how many of such, and when the last one is over. What cannot be had is no news if somebody
// has chosen another dataset since, or deletes this one.
const coming = { id: null, left: 0, over: Promise.resolve() };
function on_its_way(id, shown) {
  ++coming.left;
  const over = shown.catch((error) => { if (id === wanted.id && !builds.is_going(id)) report(error); }).finally(() => { --coming.left; });
  return Object.assign(coming, { id, over }).over;
}

// What the address or the list names is shown, or waited for: nothing else takes its place until somebody chooses something else.
async function open_dataset(id, words) {
  const turn = ++showing;
  Object.assign(wanted, { id, version: undefined });
  panel.select_dataset(id);
  if (id !== page.id) panel.say_state("", true);  // of another one; what is said while this one comes stays
  const status = await fetch_json(base_of(id)), { state, provisional, asleep, version, build, links } = status;
  if (turn !== showing) return;
  panel.offer_changes(!version || Boolean(links.version));  // what is mounted has one version, without an address
  Object.assign(wanted, { version, lazy: build === "lazy", label: panel.label_of(status) });
  const building = state === "queued" || state === "running";
  builds.look_at(id, building);
  if (building && !provisional && !asleep) return panel.say_state("Nothing can be seen of this dataset yet. It is shown as soon as something can.", true);
  if (asleep) panel.say_state("Nobody has looked at this dataset for long. It is made again.", true);
  await show_dataset(id, words);
}
const open = (id, words) => on_its_way(id, open_dataset(id, words));

// What the address names, with what is seen from where.
async function open_named(id) {
  const [longitude, latitude] = (named("seen_from") ?? "").split(",").map(Number);  // before another dataset's is forgotten
  await open(id);
  if (page.id === id && id === wanted.id && Number.isFinite(longitude) && Number.isFinite(latitude)) page.viewshed?.take({ longitude, latitude });
}

function choose(id, words) {
  builds.stay();
  write_link({ dataset: id });
  return open(id, words);
}

// All of it is asked for anew, and takes the place of what is seen.
function open_again() {
  const { id } = wanted;
  if (!id) return list_datasets();
  return page.id === id ? on_its_way(id, show_dataset(id)) : open(id);
}

const on_news = {
  open, again: open_again, report,
  gone: () => {
    ++showing;  // its other version may be on its way
    return list_datasets().catch(report);
  },
};
const news = new News(page, wanted, on_news);

// Other provisional tiles than those that are seen, told as in the event. They load one tileset after the other, however fast they come.
let due = null;
async function sharpen(id, told) {
  const waits = due !== null;
  due = { id, told };
  if (waits) return;
  for (let over = null; coming.id === id && over !== coming.over;) await (over = coming.over);
  const { id: of, told: { tiles, levels } } = due, { manifest } = page;
  due = null;
  const same = page.id === of && manifest.provisional && manifest.tiles === tiles && manifest.max_level === levels.at(-1).level;
  if (of === wanted.id && !same) await on_its_way(of, show_dataset(of));
}

async function list_datasets() {
  page.datasets = await newest_datasets();
  panel.fill_dataset_list(page.datasets, (id) => { panel.say_left_out(""); choose(id); });
  panel.select_dataset(wanted.id);
  panel.fill_failed_list(page.datasets, (id) => delete_dataset(id).then(list_datasets).catch(report));
}

// The list has the newest ones alone.
function label_of_id(id) {
  const listed = page.datasets.find((one) => one.id === id);
  return listed ? panel.label_of(listed) : (id === wanted.id && wanted.label) || id;
}

// What is chosen is deleted, once somebody has said so twice.
async function remove() {
  const { id } = wanted, label = label_of_id(id);
  if (!id || !(await is_to_go(label))) return;
  panel.say_left_out("");
  await builds.forget(id, delete_dataset(id));
  await leave(id, `“${label}” is deleted.`);
}

async function give_title() {
  const { id } = wanted;
  if (!id || !(await rename(id, label_of_id(id)))) return;
  await list_datasets();
  if (id === wanted.id) await open(id, "It has another title now.");
}

// To what was posted here, unless somebody has chosen something else since.
let before = null;  // what was looked at until then
function go_to(id) {
  before = wanted.id;
  choose(id);
  return list_datasets().catch(report);
}

const can_be_seen = ({ state, provisional }) => state === "ready" || provisional;
const first_of = (datasets) => datasets.find(can_be_seen) ?? datasets.find(({ state }) => state !== "failed");

// It is deleted, so what there is takes its place. back_to: if there still is such a one.
async function leave(id, words, back_to = null) {
  if (!id || id !== wanted.id) return list_datasets();
  ++showing;  // it may be on its way
  Object.assign(wanted, { id: null, version: undefined });
  write_link({ dataset: null });  // nobody can go back to it
  await list_datasets();
  const back = page.datasets.find((one) => one.id === back_to) ?? first_of(page.datasets);
  if (!back || !can_be_seen(back)) clear();
  if (back) return choose(back.id, words);
  offer_sample();
  document.getElementById("sample").focus();  // the button that had it is gone
  return panel.say_state(words, true);
}

// There is nothing to be looked at.
function clear() {
  const { scene, tileset } = page;
  Object.assign(page, { id: null, manifest: null, tileset: null, looks: null });
  panel.hide_manifest();
  if (!scene) return;
  tools.stop();
  await_terrain(null);
  if (tileset) scene.primitives.remove(tileset);
  hide_legend();
  home();
}
const draft = new Draft(builds.post);
const offer_sample = () => show_welcome((file) => { hide_welcome(); draft.take([file]); }, report);

const on_builds = {
  cancelled: (id) => {
    panel.say_left_out("");
    return leave(id, "Its build was cancelled, and it is deleted.", before).catch(report);
  },
  lazy: (id, is_lazy) => {
    if (wanted.lazy === is_lazy) return;
    wanted.lazy = is_lazy;
    if (page.id === id) panel.say_state(first_look());
  },
  tiles: (id, told) => {
    if (id === wanted.id) return sharpen(id, told);
    return builds.goes_to(id) && go_to(id);
  },
  ready: (id) => {
    const goes = id !== wanted.id && builds.goes_to(id);
    if (id === wanted.id) open(id);
    const listed = goes ? go_to(id) : list_datasets().catch(report);
    return listed.then(() => tell(`${label_of_id(id)} is ready.`));
  },
  failed: (words) => {
    panel.say(words, "problem");
    return list_datasets().catch(report);
  },
};

// What lies under a pixel is read from the GPU: not for each frame of a movement.
const kScale_ms = 100;

function watch_frames(scene) {
  scene.preUpdate.addEventListener(() => {
    if (page.manifest) stay_above(scene, page.tileset, page.manifest.bounds);
    page.looks?.follow(scene.camera);
  });
  scene.postRender.addEventListener(() => {
    const { tileset } = page;
    page.tilesLoaded = coming.left === 0 && look_choice.coming === 0 && is_loaded(tileset);
    if (placeholder && is_loaded(tileset)) await_terrain(null);
    if (tileset) panel.show_drawn(tileset.statistics.numberOfTrianglesSelected, fetched_bytes());
  });
  let scale_due = null;
  scene.postRender.addEventListener(() => {
    scale_due ??= setTimeout(() => { scale_due = null; show_scale(metres_a_pixel(page.widget, page.tileset)); }, kScale_ms);
    panel.show_heading(scene.camera.heading);
  });
  scene.camera.moveEnd.addEventListener(write_place);
}

// The camera, and the dataset that it is at; not while another one is waited for.
function write_place() {
  if (page.manifest && page.id === wanted.id) write_link({ dataset: wanted.id, camera: camera_numbers(page.scene.camera) });
}

const on_page = {
  // Another look has other colours.
  look: (changed) => {
    const { look, imagery } = panel.look(), shaded = look === kShadedRelief, pictures = look in kPictures || (look === "imagery" && imagery);
    if (changed === "look") panel.fill_ramps([], "");
    if (changed === "look" && page.looks) look_choice.begin_detail(page.looks);
    // Other tiles, or pictures: CesiumJS would draw nothing of a tile until it has its picture. What is on its way has the look of before.
    const others = !page.manifest?.provisional && (pictures || (changed === "look" && shaded !== page.looks?.normal_maps));
    const again = coming.left > 0 && wanted.id;
    if (page.manifest && (others || again)) {
      write_link();
      return again ? open(again) : on_its_way(page.id, show_dataset(page.id));
    }
    if (changed === "look" && page.tileset) apply_controls();
    write_link();
    return look_choice.apply();
  },
  controls: () => { write_link(); apply_controls(); },
  home, link: () => { write_place(); return window.location.href; },
  closer: () => zoom(page.widget, page.tileset, kCloser), farther: () => zoom(page.widget, page.tileset, 1 / kCloser),
  north: () => face_north(page.widget, page.tileset), tilt: () => tilt(page.widget, page.tileset),
  measure: () => tools.toggle(page.profile), "look-around": () => tools.toggle(page.viewshed),
  rename: () => give_title().catch(report), delete: () => remove().catch(report),
};

const tools = new Tools(page, report);

// False where the browser cannot draw one.
function start_globe() {
  page.widget = make_globe(report);
  if (!page.widget) return false;
  page.scene = page.widget.scene;
  watch_frames(page.scene);
  draw_after_moves(page.scene);
  tools.make();
  steer_by_keys(document.getElementById("globe"), page.scene.camera, home, () => tools.take_middle());
  window.addEventListener("hashchange", () => {  // a link that was put into this tab
    if (set_camera(page.scene.camera, camera_named())) page.scene.requestRender();
  });
  show_earth(page.scene.camera);
  return true;
}

async function start() {
  panel.start_folding();
  read_link();
  if (!start_globe()) panel.tell_no_globe();
  panel.on_controls(on_page);
  builds.on_builds(on_builds);
  take_token(() => draft.take_token());
  take_files((files) => draft.take(files), panel.say_left_out);
  window.addEventListener("popstate", () => {  // back to another dataset
    const id = named("dataset");
    if (!id || id === wanted.id) return;
    builds.stay();
    read_named();
    panel.show_values();
    open_named(id);
  });
  wanted.id = named("dataset");
  const listed = list_datasets();
  if (wanted.id) listed.catch(report);
  else await listed;
  const id = wanted.id || first_of(page.datasets)?.id;
  if (!id) return offer_sample();
  return open_named(id);
}

start().catch(report);
