/** A name that this page has until it is loaded anew: a copy of the tab is another page. */
export const PAGE = [...crypto.getRandomValues(new Uint8Array(8))]
  .map((octet) => octet.toString(16).padStart(2, "0"))
  .join("");
