// Formats that the program does not read and browsers do: WebP, HEIC and AVIF. The browser decodes them. The program
// gets the pixels as PNG with the Exif attributes of the file, so that date, place and exposure are used.
import { exifOf, formatOf } from "./exif.js";

/** @param {Uint8Array} bytes */
const crcOf = (() => {
  const table = Uint32Array.from({ length: 256 }, (_, n) => {
    for (let bit = 0; bit < 8; bit += 1) n = n & 1 ? 0xedb88320 ^ (n >>> 1) : n >>> 1;
    return n;
  });
  return (bytes) => {
    let crc = 0xffffffff;
    for (let at = 0; at < bytes.length; at += 1) crc = table[(crc ^ bytes[at]) & 255] ^ (crc >>> 8);
    return (crc ^ 0xffffffff) >>> 0;
  };
})();

/** @param {Uint8Array} bytes */
const adlerOf = (bytes) => {
  // As many sums as fit 32 bits before they are reduced.
  const PRIME = 65521, MOST = 5552;
  let [low, high] = [1, 0];
  for (let start = 0; start < bytes.length; start += MOST) {
    const end = Math.min(start + MOST, bytes.length);
    for (let at = start; at < end; at += 1) { low += bytes[at]; high += low; }
    low %= PRIME;
    high %= PRIME;
  }
  return ((high << 16) | low) >>> 0;
};

/** Bytes as zlib has them, without compressing them. @param {Uint8Array} bytes */
const stored = (bytes) => {
  const BLOCK = 65535, count = Math.max(Math.ceil(bytes.length / BLOCK), 1);
  const packed = new Uint8Array(2 + count * 5 + bytes.length + 4), view = new DataView(packed.buffer);
  packed.set([0x78, 0x01]);
  let to = 2;
  for (let block = 0; block < count; block += 1) {
    const part = bytes.subarray(block * BLOCK, (block + 1) * BLOCK);
    packed[to] = block === count - 1 ? 1 : 0;
    view.setUint16(to + 1, part.length, true);
    view.setUint16(to + 3, ~part.length & 0xffff, true);
    packed.set(part, to + 5);
    to += 5 + part.length;
  }
  view.setUint32(to, adlerOf(bytes));
  return packed;
};

/** @param {string} name @param {Uint8Array} data */
const chunk = (name, data) => {
  const bytes = new Uint8Array(12 + data.length), view = new DataView(bytes.buffer);
  view.setUint32(0, data.length);
  bytes.set([...name].map((letter) => letter.charCodeAt(0)), 4);
  bytes.set(data, 8);
  view.setUint32(8 + data.length, crcOf(bytes.subarray(4, 8 + data.length)));
  return bytes;
};

/** A picture as PNG, 8 bits of red, green and blue. @param {ImageData} image @param {Uint8Array | null} exif */
const pngOf = ({ width, height, data }, exif) => {
  const rows = new Uint8Array(height * (1 + 3 * width));
  for (let y = 0, to = 0, from = 0; y < height; y += 1) {
    to += 1;
    for (let x = 0; x < width; x += 1, from += 4) {
      rows[to++] = data[from];
      rows[to++] = data[from + 1];
      rows[to++] = data[from + 2];
    }
  }
  const header = new Uint8Array(13), view = new DataView(header.buffer);
  view.setUint32(0, width);
  view.setUint32(4, height);
  header.set([8, 2, 0, 0, 0], 8);
  const parts = [Uint8Array.of(0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a), chunk("IHDR", header)];
  if (exif) parts.push(chunk("eXIf", exif));
  parts.push(chunk("IDAT", stored(rows)), chunk("IEND", new Uint8Array()));
  const png = new Uint8Array(parts.reduce((sum, part) => sum + part.length, 0));
  let at = 0;
  for (const part of parts) { png.set(part, at); at += part.length; }
  return png;
};

/** @param {File} file @param {string} format */
const pixelsOf = async (file, format) => {
  // The levels as they are stored, without a change of colors. HEIC and AVIF have turns of their own, beside Exif's.
  const imageOrientation = format === "WebP" ? "none" : "from-image";
  const bitmap = await createImageBitmap(file, { colorSpaceConversion: "none", premultiplyAlpha: "none", imageOrientation })
    .catch(() => { throw new Error(`${file.name}: this browser does not open ${format}. Save the photograph as JPEG or PNG.`); });
  const canvas = new OffscreenCanvas(bitmap.width, bitmap.height), pen = canvas.getContext("2d", { willReadFrequently: true });
  if (!pen) throw new Error(`${file.name}: not enough memory for the picture`);
  pen.drawImage(bitmap, 0, 0);
  bitmap.close();
  return pen.getImageData(0, 0, canvas.width, canvas.height);
};

/**
 * A file as the program reads it, and what is to be said of that.
 * @param {File} file
 */
export const readable = async (file) => {
  const bytes = new Uint8Array(await file.arrayBuffer());
  const format = formatOf(bytes);
  if (!format) return { bytes, said: "" };
  const image = await pixelsOf(file, format);
  return { bytes: pngOf(image, exifOf(bytes, format)), said: `This browser decoded the ${format} file, with 8 bits per color.` };
};
