// A client's page in the browser: what it asked for, what it complained about, when it is done, what its picture shows.
import { kPatience_ms, new_page, some_frames } from "../browser.mjs";

const kGivenUp = "net::ERR_ABORTED";  // by the client itself: the camera went on before the tile was there
const kQuietPolls = 5;
const kMagentaOver = 60;  // red and blue over green; terrain is drawn in white, grey and earth colours

// Red lines of the browser's console, and every request that failed or left the two servers.
function watch(page, origins) {
  const complaints = [], answered = [];
  page.on("console", (message) => { if (message.type() === "error") complaints.push(message.text()); });
  page.on("pageerror", (error) => complaints.push(String(error)));
  page.on("requestfailed", (request) => {
    const why = request.failure()?.errorText;
    if (why !== kGivenUp) complaints.push(`${request.url()}: ${why}`);
  });
  page.on("response", (response) => {
    if (response.status() >= 400) complaints.push(`${response.url()}: ${response.status()}`);
    if ([200, 206].includes(response.status())) answered.push(response.url());
  });
  page.on("request", (request) => {
    const { protocol, origin } = new URL(request.url());
    const elsewhere = !["data:", "blob:"].includes(protocol) && !origins.includes(origin);
    if (elsewhere) complaints.push(`a request to somewhere else: ${request.url()}`);
  });
  return { complaints, answered };
}

// started: what is true on the page once it stands; prepare(page) is called before it is opened.
export async function open_client(browser, url, origins, { started = () => Boolean(globalThis.client), prepare } = {}) {
  const page = await new_page(browser);
  const seen = watch(page, origins);
  await prepare?.(page);
  await page.goto(url);
  const opened = { page, ...seen };
  await until(opened, () => page.evaluate(started), "the page never came to its end");
  return opened;
}

// Asks until the answer is true, so many polls on end; frames go by between them.
async function until({ page, complaints }, ask, otherwise, polls = kQuietPolls) {
  const end = Date.now() + kPatience_ms;
  for (let quiet = 0; quiet < polls;) {
    if (complaints.length > 0) throw new Error(complaints.join("\n"));
    if (Date.now() > end) throw new Error(otherwise);
    quiet = (await ask()) ? quiet + 1 : 0;
    await some_frames(page);
  }
}

export const come_to = (opened, ask, otherwise) => until(opened, ask, otherwise, 1);

// Clients learn what they lack only as frames go by: loaded counts once it stays so.
export async function settle(opened) {
  const settled = () => opened.page.evaluate(() => globalThis.client.settled());
  await until(opened, settled, "the client is not done loading, or shows no tile");
  return opened.page.evaluate(() => globalThis.client.tiles());
}

export async function look_down(opened, view) {
  await opened.page.evaluate((how) => globalThis.client.look_down(how), view);
  return settle(opened);
}

// Shares and spread of colours in what is on the screen now, and the most green of a pixel; kept as a file too if it is given a name.
export async function picture_of({ page }, path) {
  const png = await page.locator("#map").screenshot({ path });
  return page.evaluate(async ({ base64, over }) => {
    const image = new Image();
    image.src = `data:image/png;base64,${base64}`;
    await image.decode();
    const canvas = Object.assign(document.createElement("canvas"), { width: image.width, height: image.height });
    const context = canvas.getContext("2d");
    context.drawImage(image, 0, 0);
    const { data } = context.getImageData(0, 0, canvas.width, canvas.height);
    let magenta = 0, greenest = 0, sum = 0, squares = 0;
    for (let i = 0; i < data.length; i += 4) {
      const [red, green, blue] = [data[i], data[i + 1], data[i + 2]];
      if (red - green > over && blue - green > over) ++magenta;
      greenest = Math.max(greenest, green);
      const light = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
      sum += light;
      squares += light * light;
    }
    const pixels = data.length / 4, mean = sum / pixels;
    return { magenta: magenta / pixels, greenest, deviation: Math.sqrt(Math.max(squares / pixels - mean * mean, 0)) };
  }, { base64: png.toString("base64"), over: kMagentaOver });
}
