/** What the page asks of the server by HTTP. Errors are those the server describes. */

/** A refusal: what, where and how to go on, in the server's words where it gave some. */
export class ApiError extends Error {
  /**
   * @param {number} status of HTTP; 0 if the server was not reached
   * @param {{what: string, where?: string, fix?: string}} words
   */
  constructor(status, { what, where = "", fix = "" }) {
    super(what);
    this.status = status;
    this.what = what;
    this.where = where;
    this.fix = fix;
  }
}

const UNREACHED = { what: "the server does not answer", fix: "see whether it still runs" };

/**
 * @param {string} path
 * @param {RequestInit} [init]
 * @returns {Promise<Response>}
 */
export async function request(path, init = {}) {
  let response;
  try {
    response = await fetch(path, { cache: "no-store", credentials: "same-origin", ...init });
  } catch {
    throw new ApiError(0, { ...UNREACHED, where: path });
  }
  if (response.ok) return response;
  let words = { what: `the server answered ${response.status}`, where: path, fix: "" };
  try {
    const told = await response.json();
    if (typeof told?.what === "string") words = told;
  } catch {
    // Not in the server's own words: some other program answered, or it failed while answering
  }
  throw new ApiError(response.status, words);
}

/**
 * @param {string} path
 * @param {any} [body] sent as JSON by POST, if given
 * @returns {Promise<any>}
 */
export async function requestJson(path, body) {
  const init =
    body === undefined
      ? {}
      : {
          method: "POST",
          headers: { "Content-Type": "application/json" },
          body: JSON.stringify(body),
        };
  const response = await request(path, init);
  return response.status === 204 ? null : response.json();
}

/**
 * @param {string} path
 * @returns {Promise<ArrayBuffer>}
 */
export async function requestBytes(path) {
  // Large and unchanging: the browser may keep it
  return (await request(path, { cache: "default" })).arrayBuffer();
}

/**
 * @param {Blob} blob
 * @returns {Promise<{id: string, width: number, height: number}>}
 */
export async function uploadImage(blob) {
  const headers = { "Content-Type": blob.type || "application/octet-stream" };
  return (await request("/api/images", { method: "POST", headers, body: blob })).json();
}

/**
 * Trade the token of the address for a cookie, and take it off the address bar.
 *
 * @returns {Promise<boolean>} whether there was one
 */
export async function tradeToken() {
  const token = new URLSearchParams(location.hash.slice(1)).get("t");
  if (!token) return false;
  history.replaceState(null, "", location.pathname + location.search);
  await requestJson("/api/session", { token });
  return true;
}
