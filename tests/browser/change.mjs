// What somebody does to a dataset of the page: another title, or its end. Title and end by keys, as somebody does who sees no pointer.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";

import { open_dataset, open_page, tiles_loaded, was_said } from "./browser.mjs";
import { kSmall, kTiny } from "./controls.mjs";

const said = (page, words) => page.waitForFunction((wanted) => new RegExp(wanted).test(document.getElementById("message").textContent), words);
const focused = (page) => page.evaluate(() => document.activeElement.id || document.activeElement.value);
const listed = (page) => page.$$eval("#datasets option", (options) => options.map(({ value, textContent }) => [value, textContent]));
const title_of = async (url, id) => (await (await fetch(`${url}/v1/datasets/${id}`)).json()).title;

// Its dialog, by the name that a screen reader says.
async function open_dialog(page, button, name) {
  await page.focus(button);
  await page.keyboard.press("Enter");
  const dialog = page.getByRole("dialog", { name });
  await dialog.waitFor();
  return dialog;
}

// A dataset of its own has another title, in the page, in its list and in the service. Gives the page.
export async function try_rename(browser, url, raster) {
  const { id } = await (await fetch(`${url}/v1/datasets?name=hills.tif`, { method: "POST", body: readFileSync(raster), headers: { Prefer: "wait" } })).json();
  const { page, complaints } = await open_dataset(browser, url, id, kSmall);
  await page.click("#fold");
  await open_dialog(page, "#rename", "Rename this dataset");
  assert.deepEqual([await focused(page), await page.inputValue("#new-title")], ["new-title", "hills.tif"]);
  await page.fill("#new-title", "Nobody wants this");
  await page.keyboard.press("Escape");
  assert.equal(await focused(page), "rename", "the keys begin elsewhere after the dialog");
  await open_dialog(page, "#rename", "Rename this dataset");
  await page.fill("#new-title", "Green hills");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => document.getElementById("title").textContent === "Green hills");
  await said(page, "^It has another title now");
  assert.deepEqual((await listed(page)).filter(([one]) => one === id), [[id, "Green hills"]]);
  assert.equal(await title_of(url, id), "Green hills");
  assert.deepEqual(complaints, [], "the browser complained");
  return page;
}

// The dataset that the page shows is deleted, once somebody has said so, and another one is shown.
export async function try_delete(page, url) {
  const id = await page.evaluate(() => window.cordillera.id), open = () => open_dialog(page, "#delete", "Delete “Green hills”?");
  await page.click("#measure");
  const dialog = await open();
  const described = await page.evaluate((one) => document.getElementById(one).textContent, await dialog.getAttribute("aria-describedby"));
  assert.match(described, /tiles, all of its versions and .* raster are removed.*cannot be undone/, "what goes is not said");
  await page.keyboard.press("Escape");
  assert.equal(await page.getAttribute("#measure", "aria-pressed"), "true", "a key for the dialog ends a tool");
  assert.equal(await focused(page), "delete", "the keys begin elsewhere after the dialog");
  await open();
  assert.equal(await focused(page), "keep", "Enter deletes it");
  await page.keyboard.press("Enter");
  await dialog.waitFor({ state: "hidden" });

  const confirm = async () => { await open(); await page.keyboard.press("Tab"); await page.keyboard.press("Enter"); };
  const refusal = { type: "urn:cordillera:problem:role-too-low", detail: "the token 'reader' has the role read; this takes write", accepted: "a token with the role write" };
  const at = `${url}/v1/datasets/${id}`;  // the page asks there for news, too
  await page.route(at, (route) => (route.request().method() === "DELETE" ? route.fulfill({ status: 403, json: refusal }) : route.fallback()));
  await confirm();
  await said(page, `^${refusal.detail}. Accepted: ${refusal.accepted}$`);
  assert.equal(await title_of(url, id), "Green hills", "it is deleted although nobody, or nobody who may, has said so");
  await page.unroute(at);
  await confirm();
  await said(page, "^“Green hills” is deleted");
  assert.equal((await fetch(at)).status, 404, "the server still has it");
  const shown = await page.evaluate(() => window.cordillera.id);
  assert.ok((await listed(page)).every(([one]) => one !== id), "the page still offers it");
  assert.deepEqual([new URL(page.url()).searchParams.get("dataset"), await page.inputValue("#datasets")], [shown, shown]);
  assert.notEqual(shown, id);
  await page.close();
}

// Where there is no other one, the page is that of an empty service.
export async function try_delete_of_last(browser, url) {
  const { page, complaints } = await open_page(browser, url, kTiny);
  await page.waitForFunction(() => window.cordillera.manifest?.provisional === false);
  await tiles_loaded(page);  // tiles that are on their way would be missed
  await page.evaluate(() => {
    Object.defineProperty(document, "visibilityState", { value: "hidden" });  // so would its version, for which the page asks now and then
    document.getElementById("delete").click();  // the panel is folded
  });
  await page.click("#deleting .danger");
  await page.waitForSelector("#welcome:not([hidden])");
  await said(page, "is deleted");
  assert.deepEqual(await page.evaluate(() => [window.cordillera.tileset, document.getElementById("choice").hidden, document.activeElement.id]), [null, true, "sample"]);
  assert.equal(new URL(page.url()).searchParams.get("dataset"), null);
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// One that is being built: that its events end with an error is no news to whoever has deleted it.
export async function try_delete_of_unfinished(browser, url, id) {
  const { page } = await open_page(browser, `${url}/?dataset=${id}`, kTiny);
  await said(page, "made where you look");
  await page.route("**/v1/datasets?limit=500", (route) => route.fulfill({ json: { datasets: [] } }));  // it is older than what a list has
  await page.evaluate(() => document.getElementById("rename").click());  // the panel is folded
  await page.fill("#new-title", "Old hills");
  await page.keyboard.press("Enter");
  await was_said(page, "^It has another title now\\. A first look");
  await page.evaluate(() => {
    window.said.length = 0;
    document.getElementById("delete").click();  // the panel is folded
  });
  assert.equal(await page.textContent("#deleting-title"), "Delete “Old hills”?");
  await page.click("#deleting .danger");
  await said(page, "is deleted");
  assert.deepEqual(await page.evaluate(() => window.said.filter((words) => !/is deleted|made where you look/.test(words))), []);
  assert.equal((await fetch(`${url}/v1/datasets/${id}`)).status, 404);
  await page.close();
}

// A build that was begun on the page can be cancelled there: the service forgets it, and the page goes back to what it showed before.
export async function try_cancel(page, url, raster) {
  const before = await page.evaluate(() => window.cordillera.id);
  // It is not over, however fast it is, and something of it can be seen as soon as that is so.
  await page.route("**/events", async (route) => {
    const { state, provisional } = await (await fetch(route.request().url().replace(/\/events$/, ""))).json();
    const told = { stage: "making tiles", share: 0.1, provisional: true, tiles: 1, levels: [{ level: 1 }] };
    const names = provisional || state === "ready" ? ["progress", "tiles"] : ["progress"];
    await route.fulfill({ contentType: "text/event-stream", body: names.map((name) => `event: ${name}\ndata: ${JSON.stringify(told)}\n\n`).join("") });
  });
  // Its tiles come after the refusal below, which they leave where it is.
  let refused;
  const told = new Promise((then) => { refused = then; });
  await page.route("**/tileset.json*", (route) => told.then(() => route.fallback()));
  const posted = page.waitForResponse((response) => response.request().method() === "POST");
  await page.setInputFiles("#file", raster);
  const id = (await posted).headers().location.split("/").at(-1);
  await page.waitForFunction(() => !document.getElementById("going").hidden && !document.getElementById("stage").textContent.startsWith("sending"));
  await page.waitForFunction((wanted) => document.getElementById("datasets").value === wanted, id);
  const refusal = (route) => (route.request().method() === "DELETE" ? route.fulfill({ status: 403, json: { detail: "This takes write." } }) : route.fallback());
  await page.route(`**/v1/datasets/${id}`, refusal);
  await page.click("#cancel");
  await page.waitForFunction(() => document.getElementById("message").textContent === "This takes write.");
  await page.waitForSelector("#cancel:not([hidden])");  // the build goes on
  refused();
  await page.waitForFunction((wanted) => window.cordillera.id === wanted, id);
  assert.equal(await page.textContent("#message"), "This takes write.", "what is shown since has taken its place");
  await page.unroute(`**/v1/datasets/${id}`, refusal);
  // Other tiles of it are on their way when it is deleted, and cannot be had.
  const manifest = `${url}/v1/datasets/${id}/manifest.json`, missed = page.waitForResponse((response) => response.url() === manifest && response.status() === 404);
  const deleted = page.waitForResponse((response) => response.request().method() === "DELETE");
  await page.route(manifest, (route) => deleted.then(() => route.fallback()));
  await page.waitForRequest(manifest);
  await page.evaluate(() => { window.said.length = 0; });
  await page.click("#cancel");
  assert.equal(await focused(page), "fold", "the focus went with the button");
  assert.ok((await deleted).url().endsWith(`/${id}`), "another dataset is deleted");
  assert.equal((await fetch(`${url}/v1/datasets/${id}`)).status, 404, "the server still has it");
  assert.equal(await page.isVisible("#going"), false, "the progress is still there");
  await page.waitForFunction((wanted) => window.cordillera.id === wanted && document.getElementById("datasets").value === wanted, before);
  await page.waitForFunction(() => /cancelled, and it is deleted/.test(document.getElementById("message").textContent));
  await (await missed).finished();
  assert.deepEqual(await page.evaluate(() => window.said.filter((words) => words && !/cancelled, and it is deleted/.test(words))), [], "what it is missed for is said");
  assert.equal(new URL(page.url()).searchParams.get("dataset"), before, "the address names what is deleted");
  await page.close();
}

// A folder of finished tiles is only read.
export async function try_mounted(browser, url, id) {
  const { page } = await open_dataset(browser, url, id, kTiny);
  assert.deepEqual(await page.evaluate(() => ["rename", "delete"].map((one) => document.getElementById(one).hidden)), [true, true]);
  await page.close();
}
