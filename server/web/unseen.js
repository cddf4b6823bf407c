// For those who hear the page, or move through it by keys: words that are read out, and a focus that goes to a neighbour of what goes away.
const element = (id) => document.getElementById(id);

// For what no visible status line says.
export function tell(words) {
  element("told").textContent = words;
}

// The work that goes on, at its begin, at each of its stages, and at each quarter of a stage: its words change several times a second.
let told_of = "";
export function tell_progress(share, words) {
  const stage = words && `${words.replace(/, (\d+ %|\d+ s left)/g, "")} ${Math.floor(4 * (share ?? 0))}`;
  if (stage && stage !== told_of) tell(words);
  told_of = stage;
}

// Whether it is there. next: what has the focus in its place, if it had it.
export function show(id, shown, next) {
  const had = !shown && element(id).contains(document.activeElement);
  element(id).hidden = !shown;
  if (had) element(next).focus();
}
