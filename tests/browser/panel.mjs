// The page's panel: failed uploads apart and deletable, and small on a small window.
import assert from "node:assert/strict";

import { new_page, open_dataset, open_page, some_frames, tiles_loaded } from "./browser.mjs";
import { kTiny } from "./controls.mjs";

const share_of = (page) => page.evaluate(() => {
  const { width, height } = document.getElementById("panel").getBoundingClientRect();
  return (width * height) / (window.innerWidth * window.innerHeight);
});

// Two failed datasets; the first is deleted, by its button.
export async function try_failed_uploads(page, url, [first, second]) {
  const listed = () => page.$$eval("#datasets option", (options) => options.map(({ value }) => value));
  assert.ok(!(await listed()).some((id) => id === first || id === second), "a failed upload stands among those to look at");
  await page.click("#failed summary");
  const words = await page.textContent(`#failed-${first}`);
  assert.match(words, /no raster|cannot|not a/i, `the failed upload says why: ${words}`);
  const button = page.locator(`#failed-${first} button`);
  assert.deepEqual([await button.getAttribute("aria-label"), await button.textContent()], ["Delete bad.tif", "delete"]);
  await button.click();
  await page.waitForFunction((id) => !document.getElementById(`failed-${id}`), first);
  assert.equal((await page.request.get(`${url}/v1/datasets/${first}`)).status(), 404, "the server still has it");
  assert.equal(await page.textContent("#failed-count"), "1 upload failed");
  assert.ok(await page.$(`#failed-${second}`), "the other one is gone too");
  assert.equal(await page.evaluate(() => document.activeElement.closest("li")?.id), `failed-${second}`, "the focus went with it");
}

// Whose the data is, is text: in the panel, and among the credits of CesiumJS, which takes them for HTML.
export async function try_credits(browser, url, id) {
  const words = `Hills & <b>Sons</b> <img src="${url}/nowhere.png">; nobody <nobody@example.org>`;
  assert.equal((await fetch(`${url}/v1/datasets/${id}?attribution=${encodeURIComponent(words)}`, { method: "PATCH" })).status, 200);
  const { page, complaints } = await open_dataset(browser, url, id, kTiny);
  const open_credits = (of) => of.evaluate(() => document.querySelector(".cesium-credit-expand-link").click());
  const read_credits = (of) => of.$$eval(".cesium-credit-lightbox li", (all) => all.map(({ textContent }) => textContent));
  await open_credits(page);
  await tiles_loaded(page);  // draws frames
  const credits = await read_credits(page);
  assert.ok(credits.includes(words), `it is not among the credits: ${credits.join(" | ")}`);
  assert.deepEqual(credits.filter((one) => one !== words && one !== "Natural Earth II"), [], "it is there in pieces, too");
  assert.equal(await page.textContent("#attribution"), words);
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();

  const demo = await open_page(browser, `${url}/v1/datasets/${id}/demo/cesium.html`, { viewport: kTiny.viewport });
  await demo.page.waitForFunction(() => document.body.dataset.tiles === "final");
  await open_credits(demo.page);
  await some_frames(demo.page);  // it draws all the time
  assert.deepEqual([await read_credits(demo.page), await demo.page.textContent("#attribution")], [[], words]);
  assert.deepEqual(demo.complaints, [], "the browser complained of the page for CesiumJS");
  await demo.page.close();
}

export async function try_folding(page) {
  const before = page.viewportSize();
  await page.setViewportSize({ width: 480, height: 400 });
  await page.reload();
  await page.waitForFunction(() => !document.getElementById("details").hidden);
  const folded = await share_of(page);
  assert.ok(folded < 0.1, `folded, the panel covers ${(100 * folded).toFixed(0)} % of a small window`);
  await page.click("#fold");
  const open = await share_of(page);
  assert.ok(open > folded && open < 0.4, `unfolded, it covers ${(100 * open).toFixed(0)} %`);
  await page.click("#fold");
  assert.ok((await share_of(page)) < 0.1, "it does not fold again");
  await page.setViewportSize(before);
}

// What of the panel and of what stands at the foot lies over the tools, and which buttons are covered. What lets clicks through covers, too.
const over_the_tools = (page, card) => page.evaluate((shown) => {
  const rect = (id) => document.getElementById(id).getBoundingClientRect(), tools = rect("tools");
  const over = ["panel", "profile", "viewshed", "legend", "scale", "position"].filter((id) => {
    const { left, top, right, bottom, width } = rect(id);
    return width > 0 && right > tools.left && left < tools.right && bottom > tools.top && top < tools.bottom;
  });
  return over.concat(["fold", `${shown}-close`].filter((id) => {
    const { left, top, width, height } = rect(id);
    return !document.getElementById(id).contains(document.elementFromPoint(left + width / 2, top + height / 2));
  }));
}, card);

// In windows of all shapes: beside long words in the panel, a card and all else that stands at the foot.
export async function try_uncovered(page) {
  const before = page.viewportSize(), put = (id, shown) => page.evaluate(([one, wanted]) => { document.getElementById(one).hidden = !wanted; }, [id, shown]);
  const had = await page.evaluate(() => ["message", "place", "profile-words"].map((id) => {
    const { textContent } = document.getElementById(id);
    document.getElementById(id).textContent = "Words that are as long as those of a service that has much to say. ";
    return [id, textContent];
  }));
  for (const [width, height] of [[900, 500], [500, 350], [720, 420], [1100, 650], [701, 700], [640, 440]]) {
    await page.setViewportSize({ width, height });
    for (const card of ["profile", "viewshed"]) {
      await put(card, true);
      await some_frames(page);  // the foot follows the panel
      assert.deepEqual(await over_the_tools(page, card), [], `${width} x ${height}: covered, with the ${card}`);
      await put(card, false);
    }
  }
  await page.evaluate((all) => { for (const [id, words] of all) document.getElementById(id).textContent = words; }, had);
  await page.setViewportSize(before);
}

// A browser without WebGL: one sentence, and all that needs no picture.
export async function try_without_webgl(browser, url, { terrain, other }) {
  const page = await new_page(browser, { viewport: kTiny.viewport });
  const errors = [];
  page.on("pageerror", (error) => errors.push(String(error)));
  page.on("console", (message) => { if (message.type() === "error") errors.push(message.text()); });
  await page.addInitScript(() => { HTMLCanvasElement.prototype.getContext = () => null; });
  await page.goto(`${url}/?dataset=${terrain}`);
  await page.waitForSelector("#details:not([hidden])");
  assert.match(await page.textContent("#no-globe"), /^This browser has no WebGL, so the terrain is not drawn\. /);
  assert.deepEqual([await page.isVisible(".cesium-widget-errorPanel"), await page.isVisible("#tools"), await page.isVisible("#look")], [false, false, false]);
  assert.match(await page.textContent("#facts"), / triangles in /);
  await page.selectOption("#datasets", other);
  await page.waitForFunction((wanted) => window.cordillera.id === wanted, other);
  assert.equal(new URL(page.url()).searchParams.get("dataset"), other);
  assert.ok((await page.textContent("#snippet")).includes(`/v1/datasets/${other}`), "its address cannot be taken");
  assert.deepEqual([await page.textContent("#message"), errors], ["", []]);
  await page.close();
}

// A dataset around a pole has no pictures in Web Mercator: none is asked for, not even by a link that names one, and the list has them as off.
export async function try_polar(browser, url, id) {
  for (const query of ["", "&look=slope"]) {
    const { page, complaints, asked } = await open_page(browser, `${url}/?dataset=${id}${query}`, kTiny);
    await tiles_loaded(page);
    const { look, off, shown } = await page.evaluate(() => {
      const options = [...document.getElementById("look").options].filter(({ disabled }) => disabled);
      return { look: document.getElementById("look").value, off: options.map(({ value }) => value), shown: window.cordillera.looks.look };
    });
    assert.deepEqual([look, shown, await page.textContent("#message")], ["height", "height", ""]);
    assert.deepEqual(off, ["relief", "shaded-relief", "color-relief", "hillshade", "slope", "aspect", "imagery"]);
    assert.equal(new URL(page.url()).searchParams.get("look"), null);
    assert.ok(!asked.some((one) => /(relief|slope)\.json/.test(one)), "a picture is asked for");
    assert.deepEqual(complaints, [], "the browser complained");
    await page.close();
  }
}

// A laptop's window holds the panel, with a name that takes two lines; the name ends its line behind a _.
export async function try_low_window(page) {
  const before = page.viewportSize();
  await page.setViewportSize({ width: 1100, height: 750 });
  await page.reload();
  await page.waitForFunction(() => !document.getElementById("details").hidden);
  const { seen, whole, lines } = await page.evaluate(() => {
    const panel = document.getElementById("panel"), range = document.createRange();
    const parts = [...document.getElementById("title").childNodes].filter(({ nodeType }) => nodeType === Node.TEXT_NODE);
    const tops = parts.map((part) => { range.selectNode(part); return [...range.getClientRects()].map(({ top }) => top); });
    return { seen: panel.clientHeight, whole: panel.scrollHeight, lines: tops };
  });
  assert.ok(whole <= seen, `${whole - seen} px of the panel are cut off`);
  assert.ok(new Set(lines.flat()).size > 1, "the title has one line");
  assert.ok(lines.every((tops) => tops.length === 1), "a line of the title ends within a word");
  await page.setViewportSize(before);
}
