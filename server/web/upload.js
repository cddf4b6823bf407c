// From a file on this machine to a dataset: the upload's progress, then the build's, as the server tells it.
import { delete_dataset } from "./change.js";
import { words_of } from "./problem.js";
import { listen, refused, show_token_to } from "./token.js";

// Several files are one dataset: rasters, the first wins, and what lies beside a raster (.hdr, .prj). One alone is the body itself.
export function post_address(files, options) {
  const given = new URLSearchParams({ ...(files.length === 1 ? { name: files[0].name } : {}), ...options });
  return `v1/datasets?${given}`;
}
export function post_body(files) {
  if (files.length === 1) return files[0];
  const form = new FormData();
  for (const file of files) form.append("file", file, file.name);
  return form;
}
const name_of = (files) => files[0].name + (files.length > 1 ? ` and ${files.length - 1} more` : "");

// Calls on.progress(share, words) while they are sent, then on.posted(id) or on.failed(words, whether a token is wanted). Gives a function that
// gives up, also what is built already.
export function post_rasters(files, options, on) {
  const name = name_of(files);
  const request = new XMLHttpRequest();
  const stay = (event) => event.preventDefault();  // a tab that is closed would end it: the browser asks first
  window.addEventListener("beforeunload", stay);
  request.onloadend = () => window.removeEventListener("beforeunload", stay);
  let id = null;
  request.upload.onprogress = ({ loaded, total }) => on.progress(loaded / total, `sending ${name}, ${Math.floor((100 * loaded) / total)} %`);
  request.onerror = async () => on.failed((await unreadable(files)) ?? `${name} could not be sent: the server does not answer`);
  request.onload = () => {
    const answer = parsed(request.responseText);
    const wants_token = refused(request.status);
    if (request.status >= 400 || !answer.id) return on.failed(wants_token ?? words_of(answer, request.status), Boolean(wants_token));
    id = answer.id;
    on.posted(id);
  };
  const address = post_address(files, options);
  request.open("POST", address);
  show_token_to(request, address);
  request.send(post_body(files));
  return async () => {
    request.abort();
    if (id) await delete_dataset(id);
  };
}

// Follows a build that somebody has begun: on.progress(share or null, words, whether it is lazy), on.tiles(told) whenever there are other
// provisional tiles to be seen, then on.ready() or on.failed(words). Gives a function that ends it.
export function watch_build(id, on) {
  const stop = listen(`v1/datasets/${encodeURIComponent(id)}/events`, {
    progress: (data) => {
      const { stage, share, seconds_left, place, build } = parsed(data);
      on.progress(share ?? null, stage + (place ? `, place ${place}` : "") + (share > 0 ? `, ${Math.floor(100 * share)} %` : "") + (seconds_left > 1 ? `, ${Math.round(seconds_left)} s left` : ""), build === "lazy");
    },
    tiles: (data) => { if (parsed(data).provisional) on.tiles(parsed(data)); },
    ready: () => { stop(); on.ready(); },
    failed: (data) => {
      stop();
      const answer = parsed(data);
      on.failed(words_of(answer.error || answer, 422));
    },
  });
  return stop;
}

// A browser tells of what it cannot read as if no server answered. Undefined: it can read all of them.
export async function unreadable(files) {
  for (const file of files) {
    const read = await file.slice(0, 1).arrayBuffer().then(() => true, () => false);
    if (!read) return `${file.name} cannot be read: it is a folder, or has changed since it was chosen. Drop the files in it`;
  }
}

function parsed(text) {
  try {
    return JSON.parse(text);
  } catch {
    return {};
  }
}

// What lies in folders and is no part of a dataset. Why it is left out, or undefined.
const kStray = /^(\..*|thumbs\.db|desktop\.ini|.*\.(pdf|docx?|html?|md))$/i;
const unfit = ({ name, size }) => (kStray.test(name) ? "is no raster" : size === 0 ? "is empty" : undefined);

// Of several files those that can be posted. One alone is posted as it is: the service says what is wrong with it.
function fit_of(files, on_left_out) {
  if (files.length < 2) return files;
  const left_out = files.filter(unfit);
  if (left_out.length === 0 || left_out.length === files.length) return files;
  on_left_out(`Left out: ${left_out.map((file) => `${file.name} ${unfit(file)}`).join(", ")}.`);
  return files.filter((file) => !unfit(file));
}

// Files dropped anywhere on the page, or chosen. on_files(files); on_left_out(words): some of them are not among these; "" where all are.
export function take_files(on_files, on_left_out) {
  const drop = document.getElementById("drop"), input = document.getElementById("file");
  document.getElementById("browse").onclick = () => input.click();
  const take = (files) => {
    if (files.length === 0) return;
    on_left_out("");
    on_files(fit_of([...files], on_left_out));
  };
  input.onchange = () => { take(input.files); input.value = ""; };
  // A text that is dragged is none of the page's business.
  const over = (shown) => (event) => {
    if (!event.dataTransfer?.types.includes("Files")) return;
    event.preventDefault();
    drop.hidden = !shown;
  };
  window.addEventListener("dragenter", over(true));
  window.addEventListener("dragover", over(true));
  drop.addEventListener("dragleave", over(false));
  window.addEventListener("drop", (event) => {
    over(false)(event);
    take(event.dataTransfer?.files ?? []);
  });
}
