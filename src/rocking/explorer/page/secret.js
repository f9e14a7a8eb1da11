// The secret that every request carries. The token of the link that opened the page is exchanged for it, once; the
// storage of this origin keeps it, so that a reload, another tab and a bookmark know it. No other port has that storage.

const KEPT = "rocking-secret";

/** @returns {Promise<string>} */
async function found() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token) {
    history.replaceState(null, "", location.pathname + location.search);
    const response = await fetch("/api/secret", {method: "POST", headers: bearing(token)}).catch(() => null);
    if (response?.ok) return keep(await response.text());
  }
  try { return localStorage.getItem(KEPT) ?? ""; } catch { return ""; }
}

/** Keep it, unless the browser lets a frame keep nothing: then the page knows it until it is closed. @param {string} given */
function keep(given) {
  try { localStorage.setItem(KEPT, given); } catch { /* as said above */ }
  return given;
}

/** @param {string} what @returns {Record<string, string>} */
const bearing = (what) => ({authorization: `Bearer ${what}`});

/** The headers that let a request in. */
export const headers = bearing(await found());
