// Speaks with the server that has sent the page: one session for each tab, and a state that is asked for again and again. Addresses
// are relative to that of the page, which holds the secret of this run.

const KEY = "ctid-session";
/** Bytes that the server takes at most. */
const LARGEST = 64 * 1024 * 1024;

let session = null;
let state = null;
let told = () => {};
let timer = 0;

async function answer(response) {
  const body = await response.json().catch(() => ({}));
  if (response.ok) return body;
  const error = new Error(body.error || `the server answers ${response.status}`);
  error.status = response.status;
  throw error;
}

async function ask(path, more = {}) {
  const query = new URLSearchParams({ session, ...more });
  return answer(await fetch(`${path}?${query}`));
}

async function post(path, body, more = null) {
  const query = session && more !== null ? `?${new URLSearchParams({ session, ...more })}` : "";
  const raw = body instanceof Blob;
  return answer(await fetch(path + query, {
    method: "POST",
    headers: { "content-type": raw ? "text/csv" : "application/json" },
    body: raw ? body : JSON.stringify(body),
  }));
}

function take(next) {
  // A later one has overtaken it.
  if (state && next.version < state.version) return;
  if (next.records) {
    state = next;
    told(state);
  } else if (state) {
    state.job = next.job;
    told(state);
  }
}

/** Asks again: often while something is computed, seldom else, and not at all while nobody looks and nothing runs. */
function later() {
  clearTimeout(timer);
  const busy = state && state.job;
  if (document.hidden && !busy) return;
  timer = setTimeout(poll, busy ? 250 : 1500);
}

let lost = false;
/** Takes the state as it is now. */
export const renew = async () => take(await ask("api/state", { since: state ? state.version : 0 }));

async function poll() {
  try {
    await renew();
    if (lost) { lost = false; told(state); }
  } catch (error) {
    lost = true;
    told(state, /fetch/i.test(error.message) ? "ctid does not answer; is it still running? The page tries again." : error.message);
  }
  later();
}

/** Begins; `listener` is called with the state whenever it has changed, and with a trouble, if there is one. */
export async function begin(listener) {
  told = listener;
  const opened = await post("api/session", { session: sessionStorage.getItem(KEY) });
  session = opened.session;
  sessionStorage.setItem(KEY, session);
  document.addEventListener("visibilitychange", () => { if (!document.hidden) poll(); });
  state = opened.state;
  later();
  return opened;
}

/** Sends something that changes the state, and takes the state that comes back. */
export async function send(path, body = {}) {
  take(await post(path, body, {}));
  later();
}

export const run = (what, more = {}) => send("api/run", { what, ...more });

/** A file as it was dropped. */
export async function upload(file, heldOut) {
  if (file.size > LARGEST) {
    throw new Error(`${file.name} is larger than 64 MB, which is the most that the page takes; keep the columns that are in use, or fewer rows, or run \`ctid diagnose\` on it`);
  }
  take(await post("api/record", file, { name: file.name, held_out: heldOut }));
  later();
}

const fits = new Map();
/** Curves and parameters of a fit; they never change. */
export function fit(id) {
  if (!fits.has(id)) {
    if (fits.size > 24) fits.delete(fits.keys().next().value);
    const asked = ask("api/model", { id });
    asked.catch(() => fits.delete(id));
    fits.set(id, asked);
  }
  return fits.get(id);
}

export const data = () => ask("api/data");
export const link = (of) => `api/file?${new URLSearchParams({ session, of })}`;
export const current = () => state;
