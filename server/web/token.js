// The token of whoever may write, or read what is private: kept for as long as the tab is open, where no other tab and no other site can read it.
const kKey = "cordillera-token";

const token = () => window.sessionStorage.getItem(kKey);
const headers = () => (token() ? { Authorization: `Bearer ${token()}` } : {});

// fetch, with the token where there is one.
export const ask = (url, options = {}) => fetch(url, { ...options, headers: { ...options.headers, ...headers() } });

// An address that CesiumJS asks with the token, and all that it derives from it.
export const asked_by_cesium = (url) => new window.Cesium.Resource({ url, headers: headers() });

export function show_token_to(request) {
  for (const [name, value] of Object.entries(headers())) request.setRequestHeader(name, value);
}

// Server-sent events, by name: on[name](data). Gives a function that ends them. An EventSource cannot show a token, so with one the stream is
// read here.
export function listen(url, on) {
  if (!token()) {
    const events = new EventSource(url);
    for (const [name, hear] of Object.entries(on)) events.addEventListener(name, ({ data }) => hear(data));
    return () => events.close();
  }
  const stop = new AbortController();
  follow(url, on, stop.signal);
  return () => stop.abort();
}

// As an EventSource does: a stream that breaks off is asked for again, a refusal ends it.
async function follow(url, on, signal) {
  for (let open = true; open && !signal.aborted;) {
    open = await read_events(url, on, signal).catch(() => true);
    if (open && !signal.aborted) await new Promise((then) => setTimeout(then, 3000));
  }
}

// Whether the address has events.
async function read_events(url, on, signal) {
  const response = await ask(url, { signal });
  if (!response.ok) return false;
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

// The page's field. A new token changes what there is to see, so the page begins anew.
export function take_token() {
  const field = document.getElementById("token");
  field.value = token() ?? "";
  field.onchange = () => {
    if (field.value) window.sessionStorage.setItem(kKey, field.value.trim());
    else window.sessionStorage.removeItem(kKey);
    window.location.reload();
  };
}
