// What somebody pastes into a map of their own: ten lines for each client, with this dataset's address in them.
const kClients = {
  "CesiumJS, 3D Tiles": ({ url }) => `const widget = new Cesium.CesiumWidget("globe", { globe: false });
const tileset = await Cesium.Cesium3DTileset.fromUrl("${url}/tileset.json",
  { maximumScreenSpaceError: 0.5 });
widget.scene.primitives.add(tileset);
const { bounds: [west, south, east, north] } =
  await (await fetch("${url}/manifest.json")).json();
widget.camera.setView({ destination: Cesium.Rectangle.fromDegrees(west, south, east, north) });`,
  "CesiumJS, terrain (quantized-mesh)": ({ url }) => `const viewer = new Cesium.Viewer("globe", {
  baseLayerPicker: false,
  terrainProvider: await Cesium.CesiumTerrainProvider.fromUrl("${url}", { requestVertexNormals: true }),
});`,
  "MapLibre GL": ({ url, center }) => `const map = new maplibregl.Map({
  container: "map", center: [${center}], zoom: 10, pitch: 60,
  style: {
    version: 8,
    sources: { dem: { type: "raster-dem", url: "${url}/terrain-rgb.json" } },
    layers: [{ id: "hills", type: "hillshade", source: "dem" }],
    terrain: { source: "dem" },
  },
});`,
  "three.js, 3d-tiles-renderer": ({ url }) => `const dracoLoader = new DRACOLoader().setDecoderPath("draco/");
const tiles = new TilesRenderer("${url}/tileset-explicit.json");
tiles.registerPlugin(new GLTFExtensionsPlugin({ dracoLoader }));
tiles.errorTarget = 0.5;
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
scene.add(tiles.group);
// every frame: tiles.update();`,
  "deck.gl": ({ url }) => `// Draco's decoder, copied from draco3d beside the page
const draco = { "draco_wasm_wrapper.js": "draco/draco_wasm_wrapper.js",
  "draco_decoder.wasm": "draco/draco_decoder.wasm" };
new Tile3DLayer({
  id: "terrain", data: "${url}/tileset-explicit.json", loader: Tiles3DLoader,
  loadOptions: { modules: draco, tileset: { maximumScreenSpaceError: 1 } },
});`,
  "Leaflet, hillshade": ({ url, box }) => `L.tileLayer("${url}/hillshade/{z}/{x}/{y}.png",
  { bounds: ${box} }).addTo(map);
map.fitBounds(${box});`,
  "OpenLayers, heights as pixels": ({ url }) => `const { tiles: urls, maxzoom: maxZoom } =
  await (await fetch("${url}/terrarium.json")).json();
const heights = new TileLayer({ opacity: 0,
  source: new XYZ({ urls, maxZoom, crossOrigin: "anonymous", interpolate: false }) });
map.addLayer(heights);
map.on("click", ({ pixel }) => {
  const [r, g, b] = heights.getData(pixel);
  console.log(r * 256 + g + b / 256 - 32768);
});`,
  "QGIS": ({ url }) => `Layer > Add Layer > Add Tiled Scene Layer… > New Cesium 3D Tiles Connection
${url}/tileset-explicit.json
…or, as terrain, > New Quantized Mesh Connection
${url}/layer.json`,
  "curl": ({ url }) => `curl ${url}/manifest.json
curl '${url}/elevation?points=LON,LAT'`,
};

// bounds in degrees, west, south, east, north; url is absolute.
export function snippets_for(url, [west, south, east, north]) {
  const center = [(west + (east < west ? east + 360 : east)) / 2, (south + north) / 2].map((degrees) => degrees.toFixed(4)).join(", ");
  const box = JSON.stringify([[south, west], [north, east]].map((corner) => corner.map((degrees) => Number(degrees.toFixed(4)))));
  return Object.entries(kClients).map(([client, text]) => ({ client, text: text({ url, center, box }) }));
}
