/**
 * What the browser remembers of the page from day to day; nothing of the painting itself.
 *
 * Every run of the server may have another port, so another origin, whose storage is empty. Cookies
 * know no ports: swatches kept today are there tomorrow.
 */

const PREFIX = "meshsdf_kept_";
const YEAR = 365 * 24 * 3600; // seconds
const MOST = 3000; // bytes of one name; browsers keep 4096

/**
 * What was kept under a name, or another value if nothing was, or nothing of use.
 *
 * @template T
 * @param {string} name
 * @param {T} otherwise
 * @returns {T}
 */
export function kept(name, otherwise) {
  try {
    const text = valueOf(document.cookie, PREFIX + name);
    const value = text === null ? otherwise : JSON.parse(decodeURIComponent(text));
    const fits =
      typeof value === typeof otherwise && Array.isArray(value) === Array.isArray(otherwise);
    return value !== null && fits ? value : otherwise;
  } catch {
    return otherwise; // cookies are forbidden, or something else wrote this one
  }
}

/**
 * @param {string} name
 * @param {any} value what JSON can hold
 */
export function keep(name, value) {
  const text = encodeURIComponent(JSON.stringify(value));
  if (text.length > MOST) return;
  try {
    document.cookie = `${PREFIX}${name}=${text}; path=/; max-age=${YEAR}; samesite=strict`;
  } catch {
    // A browser that keeps nothing is no reason not to paint
  }
}

/**
 * @param {string} cookies as a document has them
 * @param {string} name
 */
export function valueOf(cookies, name) {
  for (const pair of cookies.split("; ")) {
    if (pair.startsWith(`${name}=`)) return pair.slice(name.length + 1);
  }
  return null;
}
