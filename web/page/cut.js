// JPEG files that are cut off, as by a broken connection: their header states more rows than there are.

/** The end-of-image marker, without which no row counts. */
const END = [0xff, 0xd9];
/** Fewer rows than these are not worth a search. */
const FEWEST_ROWS = 64;

/** @param {Error} error */
export const isTruncated = (error) => /truncated JPEG/.test(error.message);

/** Where the header of a JPEG file states its rows; -1 where it does not. @param {Uint8Array} bytes */
const placeOfHeight = (bytes) => {
  for (let at = 2; at + 9 < bytes.length && bytes[at] === 0xff;) {
    const marker = bytes[at + 1];
    // Start of frame: C0 to CF but for the tables among them.
    if (marker >= 0xc0 && marker <= 0xcf && ![0xc4, 0xc8, 0xcc].includes(marker)) return at + 5;
    at += 2 + ((bytes[at + 2] << 8) | bytes[at + 3]);
  }
  return -1;
};

/**
 * The file with the rows that are whole. `whyNot` reads a file, and gives the error.
 * @param {Uint8Array} bytes
 * @param {(bytes: Uint8Array) => string} whyNot
 */
export const wholeRows = (bytes, whyNot) => {
  const place = placeOfHeight(bytes);
  if (place < 0) return null;
  const height = (bytes[place] << 8) | bytes[place + 1];
  const ended = new Uint8Array(bytes.length + END.length);
  ended.set(bytes);
  ended.set(END, bytes.length);
  const rows = Number(/in row (\d+) of/.exec(whyNot(ended))?.[1] ?? height);
  if (rows < FEWEST_ROWS) return null;
  [ended[place], ended[place + 1]] = [rows >> 8, rows & 255];
  return whyNot(ended) ? null : { bytes: ended, rows, height };
};
