import { Matrix4, Vector3 } from "@math.gl/core";
import { Ellipsoid } from "@math.gl/geospatial";
import { layer_of, look_down } from "./deck_camera.js";
import { highest_in } from "./lonlat_mesh.js";

// The content that deck.gl draws, put where its own matrix says: earth-centred metres.
function mesh_of({ content }) {
  const meshes = [];
  const visit = (node, parent) => {
    const matrix = new Matrix4(parent);
    if (node.matrix) matrix.multiplyRight(node.matrix);
    if (node.translation) matrix.translate(node.translation);
    for (const { attributes, indices } of node.mesh?.primitives ?? []) {
      const at = attributes.POSITION.value, vertices = [];
      for (let i = 0; i < at.length; i += 3) {
        const point = new Vector3(at[i], at[i + 1], at[i + 2]).transform(matrix);
        vertices.push(...Ellipsoid.WGS84.cartesianToCartographic(point));
      }
      meshes.push({ vertices, triangles: indices.value });
    }
    for (const child of node.children ?? []) visit(child, matrix);
  };
  for (const node of content.gltf.scene.nodes) visit(node, content.cartesianModelMatrix);
  return meshes;
}

export function drive({ deck }) {
  const tileset = () => layer_of(deck, "terrain")?.state.tileset3d;
  let view = null, turn = 0;
  return {
    // Coarse tiles stay in the picture until finer ones were drawn and the camera moves: so it moves, by less than one sees.
    settled() {
      if (view) look_down(deck, view, (turn = 1e-4 - turn));
      return Boolean(tileset()?.isLoaded()) && tileset().selectedTiles.length > 0;
    },
    tiles: () => tileset().selectedTiles.length,
    look_down(how) {
      view = how;
      document.body.style.background = "#ff00ff";
      tileset().options.maximumScreenSpaceError = tileset().memoryAdjustedScreenSpaceError = view.error_px;
      look_down(deck, view);
    },
    hide: () => { deck.setProps({ layers: [] }); },
    heights(places) {
      const meshes = tileset().selectedTiles.flatMap(mesh_of);
      return places.map((place) => highest_in(meshes, place));
    },
  };
}
