// npm's tus-js-client: an upload that is cut off after its first part goes on where it was, and becomes a dataset.
// node resume.mjs --url URL --file RASTER --token TOKEN
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { parseArgs } from "node:util";
import { Upload } from "tus-js-client";

const { values: given } = parseArgs({ options: Object.fromEntries(["url", "file", "token"].map((name) => [name, { type: "string" }])) });
const bytes = readFileSync(given.file), headers = { Authorization: `Bearer ${given.token}` };
const options = { endpoint: `${given.url}/v1/uploads`, chunkSize: 32 << 10, metadata: { filename: "resumed.tif" }, retryDelays: null, headers };

const cut = await new Promise((then, fail) => {
  const upload = new Upload(bytes, {
    ...options, onError: fail,
    onChunkComplete: (_, sent) => { upload.abort(); then({ address: upload.url, sent }); },
  });
  upload.start();
});
assert.ok(cut.sent > 0 && cut.sent < bytes.length, `cut off after ${cut.sent} of ${bytes.length} bytes`);

let first = null;
await new Promise((then, fail) => new Upload(bytes, {
  ...options, uploadUrl: cut.address, onError: fail, onSuccess: then,
  onProgress: (sent) => { first ??= sent; },
}).start());
assert.ok(first >= cut.sent, `it began anew at ${first}, and ${cut.sent} bytes were there`);

const id = cut.address.split("/").at(-1);
const answer = await fetch(`${given.url}/v1/datasets?upload=${id}&error=100`, { method: "POST", headers: { ...headers, Prefer: "wait=300" } });
assert.equal(answer.status, 201, await answer.clone().text());
const dataset = await answer.json();
assert.equal(dataset.name, "resumed.tif", "the name in the upload's metadata");
assert.equal((await fetch(`${given.url}/v1/datasets/${dataset.id}`, { method: "DELETE", headers })).status, 204);
console.log("ok  tus-js-client: an upload that was cut off goes on");
