// The page without eyes or without a pointer: what is read out, where the focus goes, heights by keys, a ring that is seen, contrast, and a page
// that is enlarged to four times its size.
import assert from "node:assert/strict";

import { kTerrainAlone, open_page, some_frames } from "./browser.mjs";
import { look_straight_down } from "./views.mjs";

export const focused = (page) => page.evaluate(() => document.activeElement.id);

// From now on. heard(page): what was read out since, but for what the status line has.
export const hear = (page) => page.evaluate(() => {
  const told = document.getElementById("told");
  window.heard = [];
  new MutationObserver(() => window.heard.push(told.textContent)).observe(told, { childList: true });
});
export const heard = (page, words) => page.waitForFunction((wanted) => window.heard.some((one) => new RegExp(wanted).test(one)), words);

const press = async (page, ...keys) => { for (const key of keys) await page.keyboard.press(key); };

// The height in the middle, a profile and its heights, and the end of a tool, all of it by keys.
export async function try_heights_by_keys(page) {
  await page.getByRole("application", { name: "The terrain" }).waitFor();
  await look_straight_down(page, { share: 0.7, error_px: 2 });
  await hear(page);
  await page.focus("#globe");
  await page.keyboard.press("Enter");
  await heard(page, "° N, .* m above the ellipsoid, ± [\\d.]+ m");
  assert.match(await page.textContent("#ellipsoid-height"), /^-?[\d.]+ m above/);
  await page.focus("#measure");
  await page.keyboard.press("Enter");
  await page.focus("#globe");
  await press(page, "Enter", "ArrowRight", "ArrowRight", "Enter");
  await heard(page, "above sea level .* up \\d+ m, down \\d+ m, ± [\\d.]+ m");
  const slider = page.getByRole("slider", { name: "Place along the profile" });
  await slider.focus();
  const value = async () => [Number(await slider.getAttribute("aria-valuenow")), await slider.getAttribute("aria-valuetext")];
  const [first, at_first] = await value();
  await press(page, "End", "ArrowLeft");
  const [last, at_last] = await value();
  assert.deepEqual([first, last], [0, 99]);
  assert.match(at_last, /^[\d.]+ k?m: -?[\d.]+ m$/);
  assert.notEqual(at_first, at_last);
  await page.focus("#profile-close");
  await page.keyboard.press("Enter");
  assert.equal(await focused(page), "measure", "the focus went with the profile");
}

// Of the terrain, whose canvas covers what is drawn around it.
export async function try_ring(page) {
  await page.focus("#link");
  await page.keyboard.press("Tab");
  await page.focus("#globe");
  const ring = await page.evaluate(() => {
    const { content, position, borderTopWidth, zIndex, inset } = getComputedStyle(document.getElementById("globe"), "::after");
    return { content, position, borderTopWidth, zIndex, inset };
  });
  assert.deepEqual(ring, { content: '""', position: "fixed", borderTopWidth: "3px", zIndex: "1", inset: "0px" });
  await page.evaluate(() => document.activeElement.blur());
}

// WCAG's contrast of what is drawn with what is behind it, in the page's own colours over terrain as bad as it can be.
export async function try_contrast(page) {
  for (const colorScheme of ["dark", "light"]) {
    await page.emulateMedia({ colorScheme });
    const found = await page.evaluate(() => {
      const context = new OffscreenCanvas(1, 1).getContext("2d", { willReadFrequently: true });
      const drawn = (...colours) => {
        for (const colour of colours) { context.fillStyle = colour; context.fillRect(0, 0, 1, 1); }
        return [...context.getImageData(0, 0, 1, 1).data].slice(0, 3);
      };
      const light = (colour) => colour.map((byte) => byte / 255).map((share) => (share <= 0.04045 ? share / 12.92 : ((share + 0.055) / 1.055) ** 2.4))
        .reduce((sum, share, k) => sum + share * [0.2126, 0.7152, 0.0722][k], 0);
      const contrast = (one, other) => { const [low, high] = [light(one), light(other)].sort((a, b) => a - b); return (high + 0.05) / (low + 0.05); };
      const style = (id, part) => getComputedStyle(document.querySelector(id), part), root = getComputedStyle(document.documentElement);
      const worst = (colour, ...over) => Math.min(...["#555", "#bbb"].map((ground) => contrast(drawn(ground, ...over, colour), drawn(ground, ...over))));
      const paper = style("#panel").backgroundColor, field = style("#token").backgroundColor;
      return {
        text: { link: worst(style("#documents a").color, paper), placeholder: worst(style("#token", "::placeholder").color, paper, field),
          button: contrast(drawn(style("#sample").color), drawn(style("#sample").backgroundColor)) },
        parts: { ring: worst(root.getPropertyValue("--ring"), paper), edge: worst(style("#token").borderTopColor, paper) },
      };
    });
    for (const [least, all] of [[4.5, found.text], [3, found.parts]])
      for (const [name, value] of Object.entries(all)) assert.ok(value >= least, `${colorScheme}: ${name} has a contrast of ${value.toFixed(2)}, less than ${least}`);
  }
  await page.emulateMedia({ colorScheme: null });
}

// 1280 x 1024 at 400 %: whatever comes up can be come to.
export async function try_zoomed(page) {
  const before = page.viewportSize();
  await page.setViewportSize({ width: 320, height: 256 });
  await page.click("#fold");
  await some_frames(page);  // the foot follows the panel
  const outside = await page.evaluate(() => {
    const out = [];
    for (const [card, ends] of Object.entries({ profile: ["profile-chart", "profile-close"], viewshed: ["viewshed-eye", "viewshed-radius", "viewshed-close"], welcome: ["sample", "choose"] })) {
      document.getElementById(card).hidden = false;
      for (const id of ends) {
        document.getElementById(id).scrollIntoView({ block: "nearest" });
        const { left, top, right, bottom } = document.getElementById(id).getBoundingClientRect();
        const seen = document.elementFromPoint((left + right) / 2, Math.min((top + bottom) / 2, 255));
        if (window.scrollY + document.body.scrollTop > 0 || top < 0 || left < 0 || right > 320 || bottom > 256 || !document.getElementById(id).contains(seen)) out.push(id);
      }
      document.getElementById(card).hidden = true;
    }
    return out;
  });
  assert.deepEqual(outside, [], "it lies outside of the window, or something lies over it");
  await page.click("#fold");
  await page.setViewportSize(before);
}

// A narrow window has all of the pages' words without scrolling sideways, and their tables have heads.
export async function try_docs(browser, url) {
  const { page, complaints } = await open_page(browser, `${url}/docs`, { viewport: { width: 320, height: 256 } });
  const { across, headless } = await page.evaluate(() => {
    for (const drawer of document.querySelectorAll("details")) drawer.open = true;
    return { across: document.documentElement.scrollWidth, headless: [...document.querySelectorAll("table")].filter((one) => !one.querySelector("th")).length };
  });
  assert.deepEqual([across, headless], [320, 0], "its width in a window of 320 px, and tables without a head");
  assert.deepEqual(complaints, [], "the browser complained");
  await page.close();
}

// A token does not take files away that wait for it; without any the page begins anew.
export async function try_token(browser, url) {
  const { page } = await open_page(browser, url, { viewport: { width: 240, height: 180 }, ...kTerrainAlone });
  await page.waitForFunction(() => window.cordillera?.id);
  const use = (token) => page.evaluate((words) => { document.getElementById("token").value = words; document.querySelector("#token-form button").click(); }, token);
  await page.evaluate(() => { document.getElementById("options").open = true; window.same = true; });
  await page.setInputFiles("#file", { name: "north.tif", mimeType: "image/tiff", buffer: Buffer.from("no raster") });
  await page.waitForFunction(() => document.getElementById("draft-files").textContent === "north.tif" && document.getElementById("estimate").className === "problem");
  await page.fill("#token", "mine");
  await page.press("#token", "Tab");  // to leave the field is no wish
  assert.equal(await page.evaluate(() => sessionStorage.getItem("cordillera-token")), null);
  const asked = page.waitForRequest((request) => request.url().includes("dry_run"));
  await use("mine");
  assert.equal((await asked).headers().authorization, "Bearer mine");
  assert.deepEqual(await page.evaluate(() => [window.same, document.getElementById("draft-files").textContent]), [true, "north.tif"]);
  await page.evaluate(() => { document.getElementById("drop-draft").focus(); document.getElementById("drop-draft").click(); });
  assert.equal(await focused(page), "browse", "the focus went with what was to be built");
  await use("");
  await page.waitForFunction(() => !window.same && document.getElementById("token"));
  await page.close();
}

// Files that are posted at once where a token is wanted wait for it, and are built when somebody says so.
export async function try_files_before_token(browser, url) {
  const { page } = await open_page(browser, url, { viewport: { width: 480, height: 320 }, ...kTerrainAlone });
  await page.waitForFunction(() => window.cordillera?.id);
  const refusal = { status: 401, json: { status: 401, detail: "Authorization: Bearer TOKEN is missing" } };
  await page.route(/v1.datasets.name=/, (route) => (route.request().headers().authorization ? route.fallback() : route.fulfill(refusal)));
  await page.setInputFiles("#file", { name: "north.tif", mimeType: "image/tiff", buffer: Buffer.from("no raster") });
  await page.waitForFunction(() => document.getElementById("draft-files").textContent === "north.tif" && /Enter yours in the field/.test(document.getElementById("estimate").textContent));
  assert.equal(await focused(page), "token");
  await page.fill("#token", "mine");
  await page.keyboard.press("Enter");
  await page.waitForFunction(() => /Accepted: .*GeoTIFF/.test(document.getElementById("estimate").textContent));
  const posted = page.waitForRequest((request) => request.method() === "POST" && !request.url().includes("dry_run"));
  await page.click("#build");
  assert.deepEqual([(await posted).headers().authorization, (await posted).postData()], ["Bearer mine", "no raster"]);
  await page.close();
}
