// The first minute of somebody who has just unpacked the archive: opens an empty service, presses "Open the sample", waits until all its tiles are drawn.
//   node first_picture.mjs --chromium PATH --url URL --since MILLISECONDS --picture FILE
// Prints how many seconds that took since a time of day, in milliseconds as Date.now() has it.
import assert from "node:assert/strict";
import { parseArgs } from "node:util";

import { open_page, tiles_loaded, with_browser } from "./browser.mjs";

const names = ["chromium", "url", "since", "picture"];
const { values: given } = parseArgs({ options: Object.fromEntries(names.map((name) => [name, { type: "string" }])) });
const seconds = () => ((Date.now() - Number(given.since)) / 1000).toFixed(1);

await with_browser(given.chromium, async (browser) => {
  const { page, complaints } = await open_page(browser, given.url);
  await page.waitForSelector("#sample");
  const offered = seconds();
  await page.click("#sample");
  await tiles_loaded(page);
  console.log(`in headless Chromium, drawn by software: "Open the sample" was there after ${offered} s, its terrain was drawn after ${seconds()} s`);
  await page.screenshot({ path: given.picture });
  assert.deepEqual(complaints, [], "the browser complained");
});
