// What is to be posted, before it is: files, options, and what a build would make of them (a dry run).
import { bring_up, take_back_all } from "./dataset_panel.js";
import { field, kOptions, words_of } from "./problem.js";
import { ask, refused } from "./token.js";
import { show } from "./unseen.js";
import { post_address, post_body, unreadable } from "./upload.js";

const element = (id) => document.getElementById(id);

// Those that somebody has filled in.
export const chosen_options = () => Object.fromEntries(kOptions.map((name) => [name, field(name).value.trim()]).filter(([, value]) => value !== ""));

const is_open = () => element("options").open;

// on_post(files, options, { taken, wait }): they are to be built; taken() is called when the service has them, wait() if it wants a token first. With
// the drawer of options open, or with options that are still filled in, they wait there for the button; else they go at once.
export class Draft {
  constructor(on_post) {
    Object.assign(this, { on_post, files: [], turn: 0 });
    for (const name of kOptions) field(name).onchange = () => this.estimate();
    element("options").ontoggle = () => this.estimate();
    element("build").onclick = () => this.post();
    element("drop-draft").onclick = () => this.take([]);
  }

  // A new token changes what there is to see, so the page begins anew; but not while files wait on it.
  take_token() {
    if (this.files.length === 0) return window.location.reload();
    take_back_all();
    return this.estimate();
  }

  take(files) {
    this.files = files;
    if (files.length > 0 && !is_open() && Object.keys(chosen_options()).length === 0) return this.post();
    if (files.length > 0) bring_up("option-error");
    return this.estimate();
  }

  post() {
    const { files } = this;
    this.files = [];
    this.show("");
    const options = chosen_options();
    // They are of these files. Where the service refuses them, they stay to be changed.
    const taken = () => { for (const name of Object.keys(options)) if (field(name).value.trim() === options[name]) field(name).value = ""; };
    this.on_post(files, options, { taken, wait: () => this.wait(files) });
  }

  // For a token: nobody is to choose them again. Others may have come since.
  wait(files) {
    if (this.files.length > 0) return;
    this.files = files;
    element("options").open = true;
    this.estimate();
    bring_up("token");
  }

  show(words, kind = "") {
    const hidden = this.files.length === 0 || !is_open(), appears = !hidden && element("draft").hidden;
    show("draft", !hidden, "browse");
    element("draft-files").textContent = this.files.map(({ name }) => name).join(", ");
    element("estimate").textContent = words;
    element("estimate").className = kind;
    if (appears) bring_up("build");
  }

  // What the service says that a build would be. The fields that are empty say what it would take.
  async estimate() {
    const turn = ++this.turn;
    if (this.files.length === 0 || !is_open()) return this.show("");
    this.show("The service looks at it …");
    let asked = this.files, answer = await this.dry_run(asked);
    if (answer?.parameter === "dry_run") answer = await this.dry_run(asked = asked.slice(0, 1));  // it looks at one raster
    if (turn !== this.turn) return undefined;  // another question was asked meanwhile
    if (!answer) return this.show((await unreadable(asked)) ?? "The service does not answer.", "problem");
    if (!answer.manifest) return this.show(refused(answer.status) ?? words_of(answer, answer.status), "problem");
    this.fill(answer.manifest);
    return this.show((asked.length < this.files.length ? `Of ${asked[0].name} alone: ` : "") + estimate_text(answer));
  }

  // The answer, an estimate or a problem; null where there is none.
  async dry_run(files) {
    const response = await ask(post_address(files, { ...chosen_options(), dry_run: 1 }), { method: "POST", body: post_body(files) }).catch(() => null);
    return response && response.json().catch(() => ({ status: response.status }));
  }

  fill({ options, source }) {
    field("error").placeholder = options.error ? `${Number(options.error.toPrecision(3))}` : "";
    field("crs").placeholder = source.crs;
    field("vertical_datum").options[0].textContent = `${source.vertical_datum} (${source.vertical_datum_from})`;
  }
}

const kTime = [[5400, 3600, "hour"], [90, 60, "minute"], [0, 1, "second"]];
function time_text(seconds) {
  const [, unit, name] = kTime.find(([least]) => seconds >= least), count = Math.max(1, Math.round(seconds / unit));
  return `${count} ${name}${count === 1 ? "" : "s"}`;
}
const size_text = (bytes) => (bytes < 1e5 ? `${Math.max(1, Math.round(bytes / 1e3))} kB` : `${(bytes / 1e6).toFixed(1)} MB`);

function estimate_text({ manifest, seconds }) {
  const { levels, tiles, triangles, bytes, notes = [] } = manifest, [finest, coarsest] = [levels[0], levels.at(-1)];
  const error = finest.target ? `, at most ${Number(finest.target.toPrecision(3))} m off` : "";
  return [`levels ${coarsest.level} to ${finest.level}${error}`, `about ${tiles.toLocaleString("en")} tiles and ${triangles.toLocaleString("en")} triangles`,
    `${size_text(bytes)}, ${time_text(seconds)}`, ...notes].join(" · ");
}
