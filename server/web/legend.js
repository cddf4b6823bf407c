// What colours mean, and how long a kilometre is.
const element = (id) => document.getElementById(id);

const kSteps = 64;
const kPoints = ["N", "E", "S", "W", "N"];

const channels = (colour) => [1, 3, 5].map((k) => parseInt(colour.slice(k, k + 2), 16));

// Straight lines between stops, as the service draws them.
export function colour_at(stops, value) {
  const k = stops.findIndex(([stop]) => stop > value);
  if (k === 0) return stops[0][1];
  if (k < 0) return stops.at(-1)[1];
  const [[low, from], [high, to]] = [stops[k - 1], stops[k]];
  const share = (value - low) / (high - low), ends = channels(to);
  return `rgb(${channels(from).map((channel, c) => Math.round(channel + share * (ends[c] - channel))).join(" ")})`;
}

const number = (value) => Math.round(value).toLocaleString("en");

// stops: [[value, "#rrggbb"], …]; range: what of them the data has; words for the ends of it.
export function show_legend({ title, stops, range: [low, high], ticks }) {
  element("legend").hidden = false;
  element("legend-title").textContent = title;
  element("legend-bar").replaceChildren(...Array.from({ length: kSteps }, (_, k) => {
    const step = document.createElement("i");
    step.style.background = colour_at(stops, low + ((k + 0.5) / kSteps) * (high - low));
    return step;
  }));
  element("legend-ticks").replaceChildren(...ticks.map((text) => Object.assign(document.createElement("span"), { textContent: text })));
}

export function hide_legend() {
  element("legend").hidden = true;
}

// What a picture's own TileJSON says of its colours.
export function legend_of(look, { ramp, ramp_unit: unit, ramp_range: [lowest, highest] }) {
  if (look === "aspect") return { title: "Faces", stops: ramp, range: [0, 360], ticks: kPoints };
  if (look === "slope") return { title: "Slope", stops: ramp, range: [0, 60], ticks: ["0°", "15°", "30°", "45°", "60°"] };
  const at = (share) => number(lowest + share * (highest - lowest));
  return { title: `Height, ${unit}`, stops: ramp, range: [lowest, highest], ticks: [at(0), at(0.5), `${at(1)} m`] };
}

// Of terrain that is coloured here, by its heights above the ellipsoid.
export function legend_of_tint(stops) {
  const [lowest, highest] = [stops[0][0], stops.at(-1)[0]];
  return { title: "Height, metres above the ellipsoid", stops, range: [lowest, highest], ticks: [number(lowest), number((lowest + highest) / 2), `${number(highest)} m`] };
}

const kWidest_px = 120;

// metres_a_pixel: null hides the bar.
export function show_scale(metres_a_pixel) {
  element("scale").hidden = !metres_a_pixel;
  if (!metres_a_pixel) return;
  const most = kWidest_px * metres_a_pixel, power = 10 ** Math.floor(Math.log10(most));
  const length = power * [5, 2, 1].find((step) => step * power <= most);
  element("scale-words").textContent = length >= 1000 ? `${number(length / 1000)} km` : `${length >= 1 ? number(length) : length.toFixed(1)} m`;
  element("scale-bar").style.width = `${Math.round(length / metres_a_pixel)}px`;
}
