// The web server that a reader of the documents would have: their page, its bundle, and the folders that were copied beside it.
import { readFileSync } from "node:fs";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";

import { with_addresses } from "./snippets.mjs";

const kTypes = {
  ".html": "text/html", ".css": "text/css", ".js": "text/javascript", ".mjs": "text/javascript", ".json": "application/json",
  ".wasm": "application/wasm",
};

// What lies at PATH beside a client's page. The bundle has this server's addresses in place of those that documents show.
function file_of({ name, html, folders }, path, { modules, bundles, addresses }) {
  if (path === "index.html") return `<!doctype html><meta charset="utf-8"><link rel="icon" href="data:,">\n${html}`;
  if (path === "bundle.js") return with_addresses(readFileSync(join(bundles, `${name}.js`), "utf8"), addresses);
  for (const [prefix, folder] of Object.entries(folders)) {
    if (path.startsWith(prefix)) return readFileSync(join(modules, folder, path.slice(prefix.length)));
  }
  return readFileSync(join(bundles, path));
}

function answer_range(response, bytes, range) {
  const [, first, last] = range.match(/^bytes=(\d+)-(\d+)$/).map(Number);
  const part = bytes.subarray(first, last + 1);
  const what = `bytes ${first}-${first + part.length - 1}/${bytes.length}`;
  response.writeHead(206, { "Content-Range": what, ETag: `"${bytes.length}"` }).end(part);
}

// http://…/DATASET/CLIENT/index.html and http://…/DATASET/archives/NAME.pmtiles, with ranges.
// clients have a name, html and folders; datasets are names with an address and a folder of archives.
export async function start_page_server({ clients, modules, bundles, datasets }) {
  const addresses_of = (name) => ({ dataset: datasets[name].address, archives: `${url()}/${name}/archives/` });
  const server = createServer((request, response) => {
    const { pathname } = new URL(request.url, "http://page");
    const [, dataset, name, path] = normalize(pathname).match(/^\/(\w+)\/([\w-]+)\/(.+)$/) ?? [];
    try {
      if (name === "archives") {
        return answer_range(response, readFileSync(join(datasets[dataset].archives, path)), request.headers.range);
      }
      const client = clients.find((one) => one.name === name);
      const body = file_of(client, path, { modules, bundles, addresses: addresses_of(dataset) });
      response.writeHead(200, { "Content-Type": kTypes[extname(path)] ?? "application/octet-stream" }).end(body);
    } catch {
      response.writeHead(404).end();
    }
  });
  const url = () => `http://127.0.0.1:${server.address().port}`;
  await new Promise((listening) => server.listen(0, "127.0.0.1", listening));
  return { url: url(), addresses_of, stop: () => server.close() };
}
