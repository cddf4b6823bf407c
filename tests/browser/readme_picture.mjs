// node readme_picture.mjs CHROMIUM URL ID FILE: the viewer's scene from an oblique view, without its panel.
import { open_dataset, tiles_loaded, with_browser } from "./browser.mjs";

const [chromium, url, id, file] = process.argv.slice(2);
const kSize = { width: 1440, height: 640 };

await with_browser(chromium, async (browser) => {
  const { page } = await open_dataset(browser, url, id, { viewport: kSize });
  await page.evaluate(async () => {
    const { scene, looks, manifest, tileset } = window.cordillera, Cesium = window.Cesium;
    const [west, south, east, north] = manifest.bounds;
    await looks.show("hillshade");
    // The colour of the height times the hillshade.
    const { uniforms, fragmentShaderText } = looks.tint;
    looks.tint = new Cesium.CustomShader({
      uniforms, fragmentShaderText: fragmentShaderText.replace("material.diffuse = tint(", "material.diffuse *= 1.25 * tint("),
    });
    tileset.customShader = looks.tint;
    looks.exaggerate(1.6);
    tileset.maximumScreenSpaceError = 0.7;
    const middle = Cesium.Cartesian3.fromDegrees((west + east) / 2, south + (north - south) * 0.46, 0);
    scene.camera.lookAt(middle, new Cesium.HeadingPitchRange(Cesium.Math.toRadians(-14), Cesium.Math.toRadians(-24), 47000));
    scene.camera.lookAtTransform(Cesium.Matrix4.IDENTITY);
    for (const part of document.querySelectorAll("body > *")) {
      if (!part.querySelector("canvas")) part.style.display = "none";
    }
  });
  await tiles_loaded(page);
  await page.screenshot({ path: file, type: "jpeg", quality: 88 });
});
