// What both deck.gl drivers do with a Deck.

// From above the middle of the bounds, so that the picture's height covers a share of their north-south extent.
export function look_down(deck, { bounds: [west, south, east, north], share }, bearing = 0) {
  const latitude = (south + north) / 2, degrees = (share * (north - south)) / Math.cos((latitude * Math.PI) / 180);
  const zoom = Math.log2((deck.height * 360) / 512 / degrees);
  deck.setProps({ initialViewState: { longitude: (west + east) / 2, latitude, zoom, pitch: 0, bearing } });
}

export function layer_of(deck, id) {
  return deck.layerManager?.layers.find((layer) => layer.id === id);
}
