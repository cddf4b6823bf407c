// Which code is run: the block of a page, the names that the test needs from it, and the driver that looks through them.
//   tiles      what a tile's address looks like
//   heights    which heights are right: "height" (ellipsoidal) or "orthometric"
//   added_m    what the client or the format adds to the stated error of the finest level
//   share      of the data's extent that is looked at for heights; all of it if left out
//   every      one in how many of the known places is looked at; all of them if left out
//   relief     least deviation of shades in a picture of nothing but data, of 255, where that is what the client shows; a flat raster has less
//   instead    words of the block and what its page tells the reader to put in their place
//   query      in the addresses of tiles, beside what a client adds; any if left out
//   seen       other datasets whose terrain is seen at once, where the page puts its camera: small and high ("high"), over the antimeridian ("across")
//   cracks     how much of a picture from above may be background, as a share; left out where there is no background to see
export const kBrowserClients = [
  {
    name: "cesium-3d-tiles", page: "map/cesium.md", section: "3D Tiles", driver: "cesium_3d_tiles.js", names: ["widget", "tileset"],
    tiles: /\/tiles\/[WE]\/.*\.glb$/, heights: "height", added_m: 0, cracks: 0, seen: ["high"],
  },
  {
    name: "cesium-3d-tiles-lit", page: "map/cesium.md", section: "3D Tiles", driver: "cesium_3d_tiles.js", names: ["widget", "tileset"],
    instead: ["tileset.json", "tileset.json?normals=texture"], query: "normals=texture",
    tiles: /\/tiles\/[WE]\/.*\.glb$/, heights: "height", added_m: 0, cracks: 0, every: 6,
  },
  {
    name: "cesium-terrain", page: "map/cesium.md", section: "Terrain, as quantized-mesh", driver: "cesium_terrain.js",
    names: ["widget", "terrainProvider"], tiles: /\/terrain\/.*\.terrain$/, heights: "height", added_m: 0, cracks: 0, seen: ["high"],
  },
  {
    name: "cesium-terrain-mercator", page: "map/cesium.md", section: "Terrain in Web Mercator", driver: "cesium_terrain.js",
    names: ["widget", "terrainProvider"], tiles: /\/web-mercator\/terrain\/.*\.terrain$/, heights: "height", added_m: 0, cracks: 0,
    every: 6,
  },
  {
    name: "cesium-terrain-3d", page: "map/cesium.md", section: "Terrain, as 3D Tiles", driver: "cesium_terrain.js",
    names: ["widget", "terrainProvider"], tiles: /\/terrain3d\/.*\.glb$/, heights: "height", added_m: 0, cracks: 0,
  },
  {
    name: "three-3d-tiles", page: "map/threejs.md", section: "3D Tiles", driver: "three_tiles.js", names: ["tiles", "camera", "scene"],
    tiles: /\/tiles\/[WE]\/.*\.glb$/, heights: "height", added_m: 0, cracks: 0, seen: ["high"],
  },
  {
    name: "three-3d-tiles-lit", page: "map/threejs.md", section: "3D Tiles", driver: "three_tiles.js", names: ["tiles", "camera", "scene"],
    instead: ["tileset-explicit.json", "tileset-explicit.json?normals=texture"], query: "normals=texture",
    tiles: /\/tiles\/[WE]\/.*\.glb$/, heights: "height", added_m: 0, cracks: 0, every: 6,
  },
  {
    name: "three-terrain", page: "map/threejs.md", section: "Terrain, as quantized-mesh", driver: "three_tiles.js",
    names: ["tiles", "camera", "scene"], tiles: /\/terrain\/.*\.terrain$/, heights: "height", added_m: 0, cracks: 0, seen: ["high"],
  },
  {
    name: "deck-3d-tiles", page: "map/deckgl.md", section: "3D Tiles", driver: "deck_3d_tiles.js", names: ["deck"],
    tiles: /\/tiles\/[WE]\/.*\.glb$/, heights: "height", added_m: 0, seen: ["high"],
    cracks: 0.005,  // every tile is drawn in a flat frame of its own: hairlines between them
  },
  {
    name: "deck-terrain", page: "map/deckgl.md", section: "Terrain-RGB", driver: "deck_terrain.js", names: ["deck"],
    tiles: /\/terrain-rgb\/.*\.png$/, heights: "orthometric", added_m: 5, cracks: 0, seen: ["high"],
    share: 0.45,  // every tile is meshed in the page itself, in half a second
  },
  {
    name: "maplibre", page: "map/maplibre.md", section: "Terrain", goes_on: "Contours", driver: "maplibre.js", names: ["map"],
    tiles: /\/terrain-rgb\/.*\.png$/, also: /\/contours\/.*\.mvt$/, heights: "orthometric", added_m: 0, every: 6, seen: ["high"],
  },
  {
    name: "maplibre-pmtiles", page: "formats/pmtiles.md", section: "In MapLibre GL", driver: "maplibre.js", names: ["map"],
    tiles: /\/archives\/dem\.pmtiles$/, heights: "orthometric", added_m: 0, every: 6,
  },
  {
    name: "openlayers", page: "map/openlayers.md", driver: "openlayers.js", names: ["map", "heights", "height_at"],
    tiles: /\/terrarium\/.*\.png$/, heights: "orthometric", added_m: 0, every: 6, seen: ["across"],
  },
  {
    name: "leaflet", page: "map/leaflet.md", driver: "leaflet.js", names: ["map", "hills"],
    tiles: /\/hillshade\/.*\.png$/, heights: "orthometric", added_m: 0, every: 6, seen: ["across"],
    relief: 22,  // its buttons alone are 14
  },
];

// Blocks for Node.js, and the names that the test needs from them. Tiles as vertices (longitude, latitude, height) and triangles:
const kMesh = ["vertices", "triangles", "x", "y", "degrees"];
export const kMeshBlocks = [
  { name: "loaders-gl-draco", page: "map/loaders-gl.md", section: "A Draco tile", names: kMesh },
  { name: "loaders-gl-quantized-mesh", page: "map/loaders-gl.md", section: "A quantized-mesh tile", names: kMesh },
];
// Bytes of a .drc from an archive:
export const kArchiveBlocks = [{ name: "pmtiles", page: "formats/pmtiles.md", section: "Reading a tile", names: ["data", "z", "x", "y"] }];
// A tileset.json:
export const kTilesetBlocks = [{ name: "loaders-gl-3d-tiles", page: "map/loaders-gl.md", section: "3D Tiles", names: ["tileset"] }];
