// What the page asks the service: documents, and the list of datasets.
import { words_of } from "./problem.js";
import { ask, refused } from "./token.js";

export const base_of = (id) => `v1/datasets/${encodeURIComponent(id)}`;

// patient(): whether it is asked again as long as the service answers that it has to be waited for, as for a dataset that is asleep.
export async function fetch_json(url, patient = () => false) {
  const response = await ask(url);
  const wait_s = Number(response.headers.get("Retry-After"));
  if (response.status === 503 && wait_s > 0 && patient()) {
    await new Promise((then) => setTimeout(then, 1000 * wait_s));
    if (patient()) return fetch_json(url, patient);
  }
  return answered(response, ({ detail, title }) => detail || title || `${url}: HTTP ${response.status}`);
}

// What is to change something. json: its body, if it has one.
export async function send(method, url, json) {
  const body = json && { headers: { "Content-Type": "application/json" }, body: JSON.stringify(json) };
  const response = await ask(url, { method, ...body });
  return answered(response, (problem) => words_of(problem, response.status));
}

async function answered(response, words) {
  const body = await response.json().catch(() => ({})), { status } = response;
  if (!response.ok) throw Object.assign(new Error(refused(status) || words(body)), { status });
  return body;
}

// The address of the tileset: with normal maps for the look that is shaded from them, where the service makes them. A folder of finished
// tiles has the one kind that it was built with, and names no other whatever is asked for. Provisional tiles are gone before a map would
// be worth its time.
export async function tiles_of(base, { provisional }, shaded) {
  const plain = `${base}/tileset.json`, lit = `${plain}?normals=texture`;
  if (provisional || !shaded) return { url: plain, normal_maps: false };
  const response = await ask(lit);
  const normal_maps = response.ok && (await response.text()).includes(".glb?normals=texture");
  return { url: normal_maps ? lit : plain, normal_maps };
}

// A list to choose from ends where nobody would look any more; an older dataset is reached by its link.
const MOST_LISTED = 1000;
export async function newest_datasets() {
  const datasets = [];
  for (let next = "v1/datasets?limit=500"; next && datasets.length < MOST_LISTED;) {
    const here = await fetch_json(next);
    datasets.push(...here.datasets);
    next = here.next && `v1/datasets${new URL(here.next, document.baseURI).search}`;  // its path is the public one
  }
  return datasets;
}

// Of tiles, as they came over the line. The browser's own account: entries are added up once.
let bytes = 0;
export function fetched_bytes() {
  for (const entry of performance.getEntriesByType("resource")) if (entry.name.includes("/tiles/")) bytes += entry.encodedBodySize;
  performance.clearResourceTimings();
  return bytes;
}
