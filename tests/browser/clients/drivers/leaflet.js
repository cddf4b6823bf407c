// A picture has no heights: the test looks at its shades, and at what the page says after a click.
export function drive({ map, hills }) {
  const tiles = () => Object.values(hills._tiles);
  return {
    settled: () => !hills.isLoading() && tiles().length > 0 && tiles().every(({ loaded, active }) => loaded && active),
    tiles: () => tiles().length,
    look_down({ bounds: [west, south, east, north], share }) {
      const rim = (from, to) => [(from + to) / 2 - (share * (to - from)) / 2, (from + to) / 2 + (share * (to - from)) / 2];
      const [lat, lon] = [rim(south, north), rim(west, east)];
      map.fitBounds([[lat[0], lon[0]], [lat[1], lon[1]]], { animate: false });
    },
    // What the page's own click shows.
    async heights(places) {
      const found = [];
      for (const { lon, lat } of places) {
        const shown = new Promise((opened) => map.once("popupopen", ({ popup }) => opened(popup.getContent())));
        map.fire("click", { latlng: { lat, lng: lon } });
        const words = await shown;
        if (/\.\d{3}/.test(words)) throw new Error(`more digits than anybody reads: ${words}`);
        found.push(parseFloat(words));
      }
      return found;
    },
  };
}
