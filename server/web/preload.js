// A tileset that takes the place of another one: loaded before it is shown, so that nothing flashes.

// CesiumJS also calls a tileset loaded that has not begun to ask for tiles.
export const is_loaded = (tileset) => Boolean(tileset && tileset.tilesLoaded && tileset.statistics?.numberOfTilesWithContentReady > 0);

// Resolves when a tileset that is not shown yet has what the present view needs, when somebody has waited long enough for it, or when it is not
// wanted() any more.
const kLongestPreload_ms = 60000;
export function preloaded(tileset, scene, wanted) {
  tileset.preloadWhenHidden = true;
  const end = Date.now() + kLongestPreload_ms;
  return new Promise((resolve) => {
    const look = () => {
      if (is_loaded(tileset) || tileset.isDestroyed() || Date.now() > end || !wanted()) return resolve();
      scene.requestRender();  // tiles are asked for by frames, and nothing on the page moves
      return setTimeout(look, 50);
    };
    look();
  }).finally(() => { if (!tileset.isDestroyed()) tileset.show = true; });
}
