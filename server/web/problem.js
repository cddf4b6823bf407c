// A problem of the service in words for people: its own, and the fields of this page that it names as words of a query.
export const kOptions = ["error", "crs", "vertical_datum", "nodata", "voids", "imagery"];  // fields of the page, named for the service's options
export const field = (name) => document.getElementById(`option-${name}`);

const label_of = (name) => `“${field(name).labels[0].firstElementChild.textContent}”`;
const drawer = () => `“${document.querySelector("#options > summary").textContent}”`;

function place_of_fields({ detail = "", accepted = "", parameter = "" }) {
  const named = kOptions.filter((name) => parameter === name || new RegExp(`\\b${name}=`).test(`${detail} ${accepted}`));
  if (named.length === 0) return "";
  return `. On this page: ${named.map(label_of).join(", ")}, under ${drawer()}`;
}

export function words_of(problem, status) {
  const detail = problem.detail || problem.title || `the server answers ${status}`;
  return (problem.accepted ? `${detail}. Accepted: ${problem.accepted}` : detail) + place_of_fields(problem);
}
