// An empty service: what somebody sees first, and the sample that comes with the viewer.
import { ask } from "./token.js";
import { show } from "./unseen.js";

const kSample = "sample/white_mountains_srtm3.tif";
const element = (id) => document.getElementById(id);

// on_file(file): to be posted. on_failed(error).
export function show_welcome(on_file, on_failed) {
  element("welcome").hidden = false;
  element("choose").onclick = () => element("file").click();
  element("sample").onclick = () => sample_file().then(on_file, on_failed);
}

export function hide_welcome() {
  show("welcome", false, "globe");
}

async function sample_file() {
  const response = await ask(kSample);
  if (!response.ok) throw new Error(`the sample is not here: ${kSample}: HTTP ${response.status}`);
  return new File([await response.blob()], kSample.split("/").at(-1));
}
