// The relief at the first view, with normal maps and without: bytes, triangles, and how near it is to either at the finest error that the slider has.
//   node relief_figures.mjs --chromium PATH --url URL --dataset ID --folder FOLDER
import { execFileSync } from "node:child_process";
import { readFileSync } from "node:fs";
import { parseArgs } from "node:util";

import { some_frames, tiles_loaded, with_browser } from "./browser.mjs";

const { values: given } = parseArgs({ options: Object.fromEntries(["chromium", "url", "dataset", "folder"].map((name) => [name, { type: "string" }])) });
const kWindow = { width: 1440, height: 900 };
const kCheap = 0.125;  // tiles are the same however few pixels are drawn
const kFinest = "-2";

const draw_with = (page, scale) => page.evaluate((wanted) => {
  window.cordillera.widget.resolutionScale = wanted;
  window.cordillera.widget.resize();
}, scale);

async function take(browser, name, { plain, query = "" }) {
  const page = await browser.newPage({ viewport: kWindow });
  const bytes = { tiles: 0, pictures: 0 }, bodies = [];
  page.on("response", (response) => {
    const { pathname } = new URL(response.url()), kind = pathname.endsWith(".glb") ? "tiles" : /^\/v1\/.*\.png$/.test(pathname) ? "pictures" : null;
    if (kind) bodies.push(response.body().then((body) => { bytes[kind] += body.length; }));
  });
  await page.goto(`${given.url}/?dataset=${given.dataset}&look=${plain ? "relief" : "shaded-relief"}${query}`);
  await page.waitForFunction(() => window.cordillera?.tileset);
  await draw_with(page, kCheap);
  await tiles_loaded(page);
  await draw_with(page, 1);
  await tiles_loaded(page);
  await some_frames(page);
  await Promise.all(bodies);
  const triangles = await page.evaluate(() => window.cordillera.tileset.statistics.numberOfTrianglesSelected);
  const error = await page.textContent("#detail-value");
  await page.addStyleTag({ content: "#panel, #tools, #foot, .cesium-widget-credits { display: none !important; }" });
  const picture = `${given.folder}/${name}.png`;
  await page.screenshot({ path: picture });
  await page.close();
  return { triangles, bytes, error, lights: lights_of(picture) };
}

// 0 to 255 for each pixel.
function lights_of(picture) {
  const raw = `${picture}.raw`;
  execFileSync("gdal_translate", ["-q", "-of", "ENVI", "-co", "INTERLEAVE=BIP", "-b", "1", "-b", "2", "-b", "3", picture, raw]);
  const rgb = readFileSync(raw);
  return Float64Array.from({ length: rgb.length / 3 }, (_, k) => 0.2126 * rgb[3 * k] + 0.7152 * rgb[3 * k + 1] + 0.0722 * rgb[3 * k + 2]);
}

const rms = (a, b) => Math.sqrt(a.reduce((sum, light, k) => sum + (light - b[k]) ** 2, 0) / a.length);

// Mean structural similarity (Wang et al. 2004) of squares of 8 pixels, 4 apart; those in which both pictures are even are sky, and left out.
function ssim(a, b) {
  const kSide = 8, kApart = 4, kEven = 1, kSmall = [(0.01 * 255) ** 2, (0.03 * 255) ** 2];
  let sum = 0, count = 0;
  for (let y = 0; y + kSide <= kWindow.height; y += kApart) {
    for (let x = 0; x + kSide <= kWindow.width; x += kApart) {
      const total = { a: 0, b: 0, aa: 0, bb: 0, ab: 0 }, pixels = kSide * kSide;
      for (let k = 0; k < pixels; ++k) {
        const at = (y + Math.floor(k / kSide)) * kWindow.width + x + (k % kSide), p = a[at], q = b[at];
        total.a += p; total.b += q; total.aa += p * p; total.bb += q * q; total.ab += p * q;
      }
      const [p, q] = [total.a / pixels, total.b / pixels], [pp, qq, pq] = [total.aa / pixels - p * p, total.bb / pixels - q * q, total.ab / pixels - p * q];
      if (pp < kEven && qq < kEven) continue;
      sum += ((2 * p * q + kSmall[0]) * (2 * pq + kSmall[1])) / ((p * p + q * q + kSmall[0]) * (pp + qq + kSmall[1]));
      ++count;
    }
  }
  return sum / count;
}

await with_browser(given.chromium, async (browser) => {
  const query = `&detail=${kFinest}`;
  const fine_picture = await take(browser, "fine-picture", { plain: true, query }), fine_maps = await take(browser, "fine-maps", { query });
  console.log("| drawn by | error | triangles | tiles, MB | pictures, MB | off the finest with the picture: rms, SSIM | off the finest with normal maps |");
  const print = (name, { triangles, bytes, error, lights }) => {
    const off = ({ lights: finest }) => `${rms(lights, finest).toFixed(1)}, ${ssim(lights, finest).toFixed(3)}`, megabytes = (count) => (count / 1e6).toFixed(2);
    console.log(`| ${name} | ${error} | ${triangles.toLocaleString("en")} | ${megabytes(bytes.tiles)} | ${megabytes(bytes.pictures)} | ${off(fine_picture)} | ${off(fine_maps)} |`);
  };
  print("picture", await take(browser, "picture", { plain: true }));
  print("normal maps", await take(browser, "maps", {}));
  print("picture", fine_picture);
  print("normal maps", fine_maps);
});
