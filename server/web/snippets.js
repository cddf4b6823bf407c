// What somebody pastes into a map of their own: ten lines for each client, with this dataset's address in them.
const kClients = {
  "CesiumJS, 3D Tiles": (url) => `const widget = new Cesium.CesiumWidget("globe", { globe: false });
const tileset = await Cesium.Cesium3DTileset.fromUrl("${url}/tileset.json",
  { maximumScreenSpaceError: 0.5 });
widget.scene.primitives.add(tileset);
const { bounds: [west, south, east, north, low, high] } =
  await (await fetch("${url}/manifest.json")).json();
const area = Cesium.Rectangle.fromDegrees(west, south, east, north);
widget.camera.flyToBoundingSphere(
  Cesium.BoundingSphere.fromRectangle3D(area, Cesium.Ellipsoid.WGS84, (low + high) / 2),
  { duration: 0 });`,
  "CesiumJS, terrain (quantized-mesh)": (url) => `const viewer = new Cesium.Viewer("globe", {
  baseLayerPicker: false,
  terrainProvider: await Cesium.CesiumTerrainProvider.fromUrl("${url}", { requestVertexNormals: true }),
});`,
  "MapLibre GL": (url) => `const dem = { type: "raster-dem", url: "${url}/terrain-rgb.json" };
const { center: [lon, lat, zoom] } = await (await fetch(dem.url)).json();
const map = new maplibregl.Map({
  container: "map", center: [lon, lat], zoom, pitch: 60,
  style: {
    version: 8,
    sources: { dem },
    layers: [{ id: "hills", type: "hillshade", source: "dem" }],
    terrain: { source: "dem" },
  },
});`,
  "three.js, 3d-tiles-renderer": (url) => `const dracoLoader = new DRACOLoader().setDecoderPath("draco/");
const tiles = new TilesRenderer("${url}/tileset-explicit.json");
tiles.registerPlugin(new GLTFExtensionsPlugin({ dracoLoader }));
tiles.errorTarget = 0.5;
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
scene.add(tiles.group);
// every frame: tiles.update();`,
  "deck.gl": (url) => `// Draco's decoder, copied from draco3d beside the page
const draco = { "draco_wasm_wrapper.js": "draco/draco_wasm_wrapper.js",
  "draco_decoder.wasm": "draco/draco_decoder.wasm" };
new Tile3DLayer({
  id: "terrain", data: "${url}/tileset-explicit.json", loader: Tiles3DLoader,
  loadOptions: { modules: draco, tileset: { maximumScreenSpaceError: 1 } },
});`,
  "Leaflet, hillshade": (url) => `const { bounds: [west, south, east, north],
  center: [lon, lat, zoom], tiles: [template], maxzoom, attribution } =
  await (await fetch("${url}/hillshade.json")).json();
L.tileLayer(template, { attribution,
  bounds: [[south, west], [north, east]],
  maxNativeZoom: maxzoom, maxZoom: Math.max(maxzoom + 2, 18) }).addTo(map);
map.setView([lat, lon], zoom);`,
  "OpenLayers, heights as pixels": (url) => `const { tiles: urls, maxzoom: maxZoom, attribution: attributions } =
  await (await fetch("${url}/terrarium.json")).json();
const heights = new TileLayer({ opacity: 0, source: new XYZ(
  { urls, maxZoom, attributions, crossOrigin: "anonymous", interpolate: false }) });
map.addLayer(heights);
map.on("click", ({ pixel }) => {
  const [r, g, b] = heights.getData(pixel);
  console.log(r * 256 + g + b / 256 - 32768);
});`,
  "QGIS": (url) => `Layer > Add Layer > Add Tiled Scene Layer… > New Cesium 3D Tiles Connection
${url}/tileset-explicit.json
…or, as terrain, > New Quantized Mesh Connection
${url}/layer.json`,
  "curl": (url) => `curl ${url}/manifest.json
curl '${url}/elevation?points=LON,LAT'`,
};

// url is absolute.
export function snippets_for(url) {
  return Object.entries(kClients).map(([client, text]) => ({ client, text: text(url) }));
}
