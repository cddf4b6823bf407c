// Runs the code of every client page, one after another, against a real server; pages in one Chromium.
//   node look.mjs --chromium PATH --url URL --terrain ID --flat ID --across ID --high ID --known known.json --archives FOLDER
//                 --docs FOLDER --modules FOLDER --pictures FOLDER --private ID --token TOKEN
//                 --held ID --job PROCESS --lazy ID --lazy-url URL --plain URL --viewer URL [--only NAME,NAME]
import { mkdirSync, readFileSync, rmSync } from "node:fs";
import { parseArgs } from "node:util";

import { with_browser } from "../browser.mjs";
import { open_client } from "./browser_page.mjs";
import { bundle_all } from "./bundles.mjs";
import { kHeightTolerance_m } from "./checks.mjs";
import { kDemoPages, try_demo_page, try_archive_view, try_folder_page, try_folder_pictures, try_folder_view, try_following_pages, try_foreign_tiles, try_imagery_pages, try_lazy_page, try_private_imagery, try_private_page, try_qgis_page, try_without_libraries } from "./demo_pages.mjs";
import { kArchiveBlocks, kBrowserClients, kMeshBlocks, kTilesetBlocks } from "./clients.mjs";
import { try_archive_block, try_mesh_block, try_drc_program, try_tileset_block } from "./node_clients.mjs";
import { start_page_server } from "./page_server.mjs";
import { block_of, page_of, snippet_of } from "./snippets.mjs";
import { try_browser_client } from "./try_browser.mjs";

const options = ["chromium", "url", "terrain", "flat", "across", "high", "known", "archives", "docs", "modules", "pictures", "private", "token", "held", "job", "lazy", "lazy-url", "plain", "viewer", "only"];
const { values: given } = parseArgs({ options: Object.fromEntries(options.map((name) => [name, { type: "string" }])) });
const wanted = ({ name }) => !given.only || given.only.split(",").includes(name);
const in_browser = kBrowserClients.filter(wanted);
const entries = new URL("./entries", import.meta.url).pathname;

let failures = 0;
async function run(name, body) {
  const start = Date.now();
  try {
    const seen = await body();
    console.log(`ok  ${name}: ${seen}; ${((Date.now() - start) / 1000).toFixed(1)} s`);
  } catch (error) {
    ++failures;
    console.error(`FAILED  ${name}: ${error.message}`);
  }
}

function read_snippet(client) {
  client.snippet = snippet_of(`${given.docs}/${client.page}`, client.section);
  if (client.goes_on) client.snippet += snippet_of(`${given.docs}/${client.page}`, client.goes_on);
  if (client.instead) client.snippet = client.snippet.replace(...client.instead);
  return client;
}

async function run_node(shared) {
  const kinds = [[kMeshBlocks, try_mesh_block], [kArchiveBlocks, try_archive_block], [kTilesetBlocks, try_tileset_block]];
  for (const [clients, attempt] of kinds) {
    for (const client of clients.filter(wanted)) await run(client.name, () => attempt(read_snippet(client), shared));
  }
  if (wanted({ name: "drc-program" })) await run("drc-program", () => try_drc_program(block_of(`${given.docs}/formats/drc.md`, "draco3d"), shared));
}

async function run_browser(pages, shared) {
  await with_browser(given.chromium, async (browser) => {
    for (const client of in_browser) {
      const open = (dataset) => open_client(browser, `${pages.url}/${dataset}/${client.name}/index.html`, [pages.url, given.url]);
      const allowed_m = shared.allowed_m + client.added_m;
      const control = in_browser.find(({ driver }) => driver === client.driver) === client;  // once for each that looks
      await run(client.name, () => try_browser_client(client, { ...shared, open, allowed_m, control }));
    }
    await run_demo_pages({ browser, url: given.url, id: given.terrain, modules: given.modules, pictures: given.pictures });
  });
}

async function run_demo_pages(shared) {
  const among = (name) => wanted({ name: `demo-${name}` });
  for (const name of kDemoPages.filter(among)) await run(`demo-${name}`, () => try_demo_page(name, shared));
  const kFilled = 30;  // of shades where the terrain is no speck
  const each = (names, id) => async () => {
    const seen = [];
    for (const name of names) seen.push(await try_demo_page(name, { ...shared, id, least: kFilled, picture: `${name}-elsewhere` }));
    return seen.join("; ");
  };
  if (among("across")) await run("demo-across", each(["openlayers", "leaflet", "cesium"], given.across));
  if (among("high")) await run("demo-high", each(["threejs", "deckgl", "maplibre"], given.high));
  if (among("qgis")) await run("demo-qgis", () => try_qgis_page(shared));
  if (among("live")) await run("demo-live", () => try_following_pages({ ...shared, id: given.held, job: Number(given.job) }));
  if (among("lazy")) await run("demo-lazy", () => try_lazy_page({ ...shared, url: given["lazy-url"], id: given.lazy }));
  if (wanted({ name: "folder-page" })) await run("folder-page", () => try_folder_page({ ...shared, plain: given.plain }));
  if (wanted({ name: "folder-pictures" })) await run("folder-pictures", () => try_folder_pictures({ ...shared, plain: given.plain }));
  if (wanted({ name: "archive-view" })) await run("archive-view", () => try_archive_view({ ...shared, viewer: given.viewer }));
  if (wanted({ name: "folder-view" })) await run("folder-view", () => try_folder_view({ ...shared, viewer: given.viewer }));
  if (among("imagery")) await run("demo-imagery", () => try_imagery_pages({ ...shared, id: given.private, other: given.terrain, token: given.token }));
  if (among("private")) await run("demo-private", () => try_private_page({ ...shared, id: given.private, token: given.token }));
  if (among("private")) await run("without-libraries", () => try_without_libraries({ ...shared, id: given.terrain, plain: given.plain }));
  if (among("private")) await run("private-foreign", () => try_foreign_tiles({ ...shared, id: given.private, token: given.token }));
  if (among("private")) await run("private-imagery", () => try_private_imagery({ ...shared, id: given.private, other: given.terrain, token: given.token }));
}

rmSync(entries, { recursive: true, force: true });
mkdirSync(entries, { recursive: true });
for (const client of in_browser) Object.assign(read_snippet(client), page_of(`${given.docs}/${client.page}`));
await bundle_all(in_browser, entries);
const dataset = (id) => ({ address: `${given.url}/v1/datasets/${id}`, archives: `${given.archives}/${id}` });
const datasets = Object.fromEntries(["terrain", "flat", "across", "high"].map((name) => [name, dataset(given[name])]));
const pages = await start_page_server({ clients: in_browser, modules: given.modules, bundles: `${entries}/out`, datasets });
const manifest = await (await fetch(`${datasets.terrain.address}/manifest.json`)).json();
const shared = {
  addresses_of: pages.addresses_of, pictures: given.pictures, known: JSON.parse(readFileSync(given.known, "utf8")), manifest,
  bounds: manifest.bounds, allowed_m: manifest.levels[0].stated_max_error + kHeightTolerance_m,
};
await run_node(shared);
await run_browser(pages, shared);
process.exit(failures > 0 ? 1 : 0);
