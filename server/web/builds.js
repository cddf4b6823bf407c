// The builds that the page listens to: that of the dataset that is looked at, so that it sharpens, and those of rasters that were posted here.
// The bar is for what was posted last, until that can be seen or is over; else for the dataset that is looked at.
import { show_progress } from "./dataset_panel.js";
import { post_rasters, watch_build } from "./upload.js";

const stops = new Map();  // by id: ends the listening
const mine = new Set();   // posted here, and not over
const going = new Set();  // being deleted, or gone
let shown = null;         // the dataset that is looked at, or waited for
let last = null;          // { id, name, cancel, goes } of what was posted last; goes: the page is to show it
let on = null;

// tiles(id, told), ready(id), failed(words): what becomes of them. lazy(id, is_lazy): whether its blocks are made where people look.
// cancelled(id): it is deleted; null if it was not known yet.
export function on_builds(what) {
  on = what;
}

// id is looked at from now on. building: there is more of it to come.
export function look_at(id, building) {
  if (shown !== id && !last) show_progress(null);
  shown = id;
  if (building && !stops.has(id)) listen_to(id);
  for (const one of [...stops.keys()]) if (one !== shown && !mine.has(one)) stop_listening(one);
}

// Somebody has chosen what to look at: what was posted here does not take its place.
export function stay() {
  if (last) last.goes = false;
}

// Whether the page is to show it although it shows something else.
export const goes_to = (id) => last?.id === id && last.goes;

// Posts them. Of several posts the page goes to the last one. taken(): the service has them; wait(): it wants a token first.
export function post(files, options, { taken, wait }) {
  const upload = (last = { id: null, name: files[0].name, goes: true, cancel: null });
  const give_up = post_rasters(files, options, {
    progress: (share, words) => { if (upload === last) show_progress(share, words, upload.cancel); },
    posted: (id) => {
      upload.id = id;
      taken();
      mine.add(id);
      listen_to(id);
    },
    failed: (words, wants_token) => {
      over(upload);
      on.failed(words);
      if (wants_token) wait();
    },
  });
  upload.cancel = () => {
    const given_up = give_up();
    if (!upload.id) over(upload);
    (upload.id ? forget(upload.id, given_up) : given_up).then(() => on.cancelled(upload.id), ({ message }) => on.failed(message));
  };
}

export const is_going = (id) => going.has(id);

// It is being deleted: what is heard of that is no news, unless that is refused. deleted: a promise of it, which is given back.
export async function forget(id, deleted) {
  const listened = stops.has(id), was_mine = mine.delete(id), upload = last?.id === id ? last : null;
  going.add(id);
  stop_listening(id);
  if (upload) over(upload);
  else if (id === shown && !last) show_progress(null);
  await deleted.catch((error) => {
    going.delete(id);
    if (was_mine) mine.add(id);
    if (upload) last ??= upload;
    if (listened && (was_mine || id === shown)) listen_to(id);
    throw error;
  });
}

function over(upload) {
  if (upload.id) { mine.delete(upload.id); stop_listening(upload.id); }
  if (upload !== last) return;
  last = null;
  show_progress(null);
}

function stop_listening(id) {
  stops.get(id)?.();
  stops.delete(id);
}

function listen_to(id) {
  stops.set(id, watch_build(id, {
    progress: (share, words, is_lazy) => progress(id, share, words, is_lazy),
    tiles: (told) => on.tiles(id, told),
    ready: () => end(id, () => on.ready(id)),
    failed: (words) => end(id, () => on.failed(words)),
  }));
}

// what() is called while it is still known what was posted last.
function end(id, what) {
  stop_listening(id);
  what();
  if (last?.id === id) over(last);
  else if (id === shown && !last) show_progress(null);
  mine.delete(id);
}

// Of a lazy one nobody knows an end, so it has no bar. Its first tiles are all that a post of it makes.
function progress(id, share, words, is_lazy) {
  if (is_lazy && last?.id === id) {
    last = null;
    show_progress(null);
  }
  if (is_lazy) mine.delete(id);
  if (id === shown) on.lazy(id, is_lazy);
  if (last?.id === id) show_progress(share, id === shown ? words : `${last.name}: ${words}`, last.cancel);
  else if (id === shown && !last) show_progress(share, is_lazy ? "" : words);
}
