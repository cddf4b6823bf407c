// What may happen to the dataset while it is shown: another version, its end, a service that does not answer for a while, a tile that is missing.
import * as panel from "./dataset_panel.js";
import { base_of, fetch_json } from "./service.js";

const kNews_ms = 10000, kSilence_ms = 2000;
const kGone = "This dataset is not there any more. What is still seen of it goes with this page.";
const kSilent = "The service does not answer. What is missing here comes as soon as it does.";
const kChanged = "This dataset has changed: this is its new version.";
const kAnswers = ["The service answers again.", 4000];

export class News {
  // page, wanted: what is shown, and what somebody chose. on.open(id, words), on.again(): the same dataset with all of its tiles asked for anew;
  // on.gone(), on.report(error).
  constructor(page, wanted, on) {
    Object.assign(this, { page, wanted, on, silence: null, asked: null, anew: null, missed: new WeakMap() });
    window.setInterval(() => this.look(), kNews_ms);
    document.addEventListener("visibilitychange", () => this.look());
  }

  // A raster is replaced, or somebody gives the dataset another title: tiles and words of one version are shown, never of two. Or it is deleted.
  async look() {
    const { page, wanted } = this, { id, version } = wanted;
    if (document.visibilityState !== "visible" || !version || page.id !== id || page.manifest.provisional) return;
    const now = await fetch_json(base_of(id)).catch(({ status }) => (status === 404 ? kGone : null));  // the service may be away for a moment
    if (!now || wanted.id !== id || wanted.version !== version) return;
    if (now === kGone) this.tell_gone();
    else if (now.version !== version) await this.on.open(id, kChanged);
  }

  tell_gone() {
    this.wanted.version = undefined;  // it is not asked for again
    panel.say_state(kGone, true);
    this.on.gone();
  }

  // A tile that cannot be had. It is asked for once more, with all others: the service may have been away. Or the dataset is gone.
  async tell_of_tile(tileset, failed) {
    if (this.page.tileset !== tileset) return this.missed.set(tileset, failed);  // it is not shown yet
    if (!(await this.answers())) return this.wait();
    await this.look();
    if (this.page.tileset !== tileset || !this.wanted.version) return undefined;
    if (this.anew !== this.wanted.version) {
      this.anew = this.wanted.version;
      return this.on.again();
    }
    return this.on.report(new Error(`${failed.url}: ${failed.message}`));
  }

  // A picture that cannot be had. There are places without one, so only a service that does not answer is told.
  async tell_of_picture(tileset) {
    this.asked ??= this.answers().finally(() => setTimeout(() => { this.asked = null; }, kSilence_ms));  // for many pictures at once
    if (this.page.tileset === tileset && !(await this.asked)) await this.wait();
  }

  // It is shown from now on.
  shown(tileset) {
    const failed = this.missed.get(tileset);
    if (failed) this.tell_of_tile(tileset, failed).catch(this.on.report);
  }

  answers() {
    return fetch_json(this.wanted.id ? base_of(this.wanted.id) : "v1").then(() => true, ({ status }) => Boolean(status) && status < 502);
  }

  // Until it answers. Then what could not be had is asked for again.
  wait() {
    return this.silence ??= this.wait_for_answer();
  }
  async wait_for_answer() {
    panel.say(kSilent, "problem");
    do await new Promise((then) => setTimeout(then, kSilence_ms)); while (!(await this.answers()));
    this.page.error = null;
    this.anew = null;
    panel.say_for(...kAnswers);
    this.silence = null;  // it may fall silent again meanwhile
    await this.on.again();
  }
}
