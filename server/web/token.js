// The token of whoever may write, or read what is private: kept for as long as the tab is open, where no other tab and no other site can read it.
import { bring_up } from "./dataset_panel.js";

const kKey = "cordillera-token";

const token = () => window.sessionStorage.getItem(kKey);
// The service's addresses lie below this page's. Documents of a dataset may name others, and nobody else is shown the token.
const is_own = (url) => new URL(url, document.baseURI).href.startsWith(new URL(".", document.baseURI).href);
const headers_for = (url) => (token() && is_own(url) ? { Authorization: `Bearer ${token()}` } : {});

// fetch, with the token where there is one. It fails with words for people where nobody answers; then error.silent is true.
export async function ask(url, options = {}) {
  const response = await fetch(url, { ...options, headers: { ...options.headers, ...headers_for(url) } })
    .catch((error) => { throw error instanceof TypeError ? Object.assign(new Error("The service does not answer."), { silent: true }) : error; });
  refused(response.status);
  return response;
}

// Where the service wants a token, or another one: what somebody is told, and the field for it comes up. Undefined for other answers.
const kUnauthorized = 401;
let told_of;  // the token with which somebody has been sent to the field: requests that nobody waits for go on, and are refused, too
export function refused(status) {
  if (status !== kUnauthorized) return undefined;
  if (told_of !== (token() ?? "")) {
    told_of = token() ?? "";
    bring_up("token");
    document.getElementById("token").focus();
  }
  return token() ? "The service does not know this token. Enter another one in the field “Token”." : "The service asks for a token here. Enter yours in the field “Token”.";
}

// An address that CesiumJS asks with the token, and all that it derives from it. It hands headers on to whatever a document names, so they are
// those of the address that is asked for.
let Own;
export function asked_by_cesium(url) {
  Own ??= class extends window.Cesium.Resource {
    get headers() { return headers_for(this.url); }
    set headers(_) {}
    clone(result) { return super.clone(result ?? new Own({ url: this._url })); }
  };
  return new Own({ url });
}

export function show_token_to(request, url) {
  for (const [name, value] of Object.entries(headers_for(url))) request.setRequestHeader(name, value);
}

// Server-sent events, by name: on[name](data). Gives a function that ends them. The stream is read here: an EventSource cannot show a token, and
// gives up for good where a proxy answers for a service that starts anew.
export function listen(url, on) {
  const stop = new AbortController();
  follow(url, on, stop.signal);
  return () => stop.abort();
}

// A stream that breaks off is asked for again, also where nobody answers for a while. A refusal ends it.
async function follow(url, on, signal) {
  for (let open = true; open && !signal.aborted;) {
    open = await read_events(url, on, signal).catch(() => true);
    if (open && !signal.aborted) await new Promise((then) => setTimeout(then, 3000));
  }
}

// Whether the address has events, now or later.
async function read_events(url, on, signal) {
  const response = await ask(url, { signal });
  if (!response.ok) return response.status === 429 || response.status >= 500;
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (let { done, value } = await reader.read(); !done; { done, value } = await reader.read()) {
    const events = (text + value).split("\n\n");
    text = events.pop();
    for (const event of events) {
      const name = /^event: (.*)$/m.exec(event)?.[1];
      if (name && on[name]) on[name](/^data: (.*)$/m.exec(event)?.[1] ?? "");
    }
  }
  return true;
}

// The page's field. on_token(): there is another one, or none any more.
export function take_token(on_token) {
  const field = document.getElementById("token");
  field.value = token() ?? "";
  document.getElementById("token-form").onsubmit = (event) => {
    event.preventDefault();
    if (field.value) window.sessionStorage.setItem(kKey, field.value.trim());
    else window.sessionStorage.removeItem(kKey);
    on_token();
  };
}
