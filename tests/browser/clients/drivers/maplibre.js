// Heights are asked for where the camera is, since only there the finest tiles are loaded: it goes from place to place.
const kNear = 13;  // zoom at which no coarser tiles than the finest will do

export function drive({ map }) {
  const drawn = () => map.terrain?.tileManager.getRenderableTiles().length ?? 0;
  const height_at = async ({ lon, lat }) => {
    map.jumpTo({ center: [lon, lat], zoom: kNear, pitch: 0 });
    await map.once("idle");
    return map.queryTerrainElevation([lon, lat]);
  };
  return {
    settled: () => map.loaded() && map.areTilesLoaded() && drawn() > 0,
    tiles: drawn,
    look_down({ bounds: [west, south, east, north], share }) {
      const degrees = (share * (north - south)) / Math.cos((((south + north) / 2) * Math.PI) / 180);
      const zoom = Math.log2((map.getContainer().clientHeight * 360) / 512 / degrees);
      map.jumpTo({ center: [(west + east) / 2, (south + north) / 2], zoom, pitch: 0, bearing: 0 });
    },
    async heights(places) {
      map.setLayoutProperty("hills", "visibility", "none");
      const found = [];
      for (const place of places) found.push(await height_at(place));
      return found;
    },
  };
}
