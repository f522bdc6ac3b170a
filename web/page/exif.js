// The Exif attributes of WebP, HEIC and AVIF files, as the block that a PNG file may have.
//
// Reference: the WebP container specification; ISO/IEC 14496-12 (boxes `meta`, `iinf`, `iloc`) and 23008-12 (the
// item `Exif`); Exif 2.32, 4.6.

/** @param {Uint8Array} bytes @param {number} at */
const nameAt = (bytes, at) => String.fromCharCode(...bytes.subarray(at, at + 4));

/** The format of a file that is left to the browser; "" of others. @param {Uint8Array} bytes */
export const formatOf = (bytes) => {
  if (nameAt(bytes, 0) === "RIFF" && nameAt(bytes, 8) === "WEBP") return "WebP";
  if (nameAt(bytes, 4) !== "ftyp") return "";
  const brand = nameAt(bytes, 8);
  if (["avif", "avis"].includes(brand)) return "AVIF";
  return ["heic", "heix", "heim", "heis", "hevc", "hevx", "mif1", "msf1"].includes(brand) ? "HEIC" : "";
};

/** @param {Uint8Array} bytes */
const viewOf = (bytes) => new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);

/** The chunk `EXIF` of a WebP file. @param {Uint8Array} bytes */
const ofWebp = (bytes) => {
  const view = viewOf(bytes);
  for (let at = 12; at + 8 <= bytes.length;) {
    const length = view.getUint32(at + 4, true);
    if (nameAt(bytes, at) === "EXIF") return bytes.subarray(at + 8, at + 8 + length);
    at += 8 + length + (length % 2);
  }
  return null;
};

/** The boxes in a part of a file: name, start and end of their content. @param {Uint8Array} bytes */
const boxes = (bytes, start = 0, end = bytes.length) => {
  const view = viewOf(bytes), found = [];
  for (let at = start; at + 8 <= end;) {
    const short = view.getUint32(at);
    const [head, length] = short === 1 ? [16, Number(view.getBigUint64(at + 8))] : [8, short || end - at];
    if (length < head) break;
    found.push({ name: nameAt(bytes, at + 4), start: at + head, end: Math.min(at + length, end) });
    at += length;
  }
  return found;
};

/** The number of the item `Exif`, from the box `iinf`. @param {Uint8Array} bytes @param {{ start: number, end: number }} box */
const exifItem = (bytes, { start, end }) => {
  const view = viewOf(bytes), first = start + (bytes[start] ? 8 : 6);
  for (const { name, start: at } of boxes(bytes, first, end)) {
    const isLong = bytes[at] === 3;
    if (name === "infe" && bytes[at] >= 2 && nameAt(bytes, at + (isLong ? 10 : 8)) === "Exif") return isLong ? view.getUint32(at + 4) : view.getUint16(at + 4);
  }
  return null;
};

/** Where an item is in the file, from the box `iloc`: its first piece. @param {Uint8Array} bytes @param {{ start: number }} box @param {number} wanted */
const pieceOf = (bytes, { start }, wanted) => {
  const view = viewOf(bytes), version = bytes[start];
  const sizes = [bytes[start + 4] >> 4, bytes[start + 4] & 15, bytes[start + 5] >> 4, version ? bytes[start + 5] & 15 : 0];
  let at = start + 6;
  const take = (size) => {
    at += size;
    return size === 8 ? Number(view.getBigUint64(at - 8)) : size === 4 ? view.getUint32(at - 4) : size === 2 ? view.getUint16(at - 2) : 0;
  };
  const [offsetSize, lengthSize, baseSize, indexSize] = sizes, idSize = version < 2 ? 2 : 4;
  for (let left = take(idSize); left > 0; left -= 1) {
    const item = take(idSize), method = version ? take(2) & 15 : 0;
    take(2);
    const base = take(baseSize), pieces = take(2);
    for (let piece = 0; piece < pieces; piece += 1) {
      take(indexSize);
      const from = base + take(offsetSize), length = take(lengthSize);
      if (item === wanted && method === 0) return bytes.subarray(from, from + length);
    }
  }
  return null;
};

/** The item `Exif` of a HEIC or AVIF file. @param {Uint8Array} bytes */
const ofBoxes = (bytes) => {
  const meta = boxes(bytes).find(({ name }) => name === "meta");
  if (!meta) return null;
  const inner = boxes(bytes, meta.start + 4, meta.end);
  const [items, places] = ["iinf", "iloc"].map((wanted) => inner.find(({ name }) => name === wanted));
  const item = items && exifItem(bytes, items);
  const piece = places && item !== null && item !== undefined && pieceOf(bytes, places, item);
  // Before the attributes is the distance to them.
  return piece ? piece.subarray(4 + viewOf(piece).getUint32(0)) : null;
};

/** Without a word of how to turn the picture: the boxes of the file have one, which the browser heeds. @param {Uint8Array} exif */
const upright = (exif) => {
  const ORIENTATION = 0x0112;
  const turned = exif.slice(), view = viewOf(turned), isLittle = nameAt(turned, 0).startsWith("II");
  const directory = view.getUint32(4, isLittle);
  for (let left = view.getUint16(directory, isLittle), at = directory + 2; left > 0; left -= 1, at += 12) {
    if (view.getUint16(at, isLittle) === ORIENTATION) view.setUint16(at + 8, 1, isLittle);
  }
  return turned;
};

/** The attributes as they are in a TIFF file; null where there are none. @param {Uint8Array} bytes @param {string} format */
export const exifOf = (bytes, format) => {
  try {
    const found = format === "WebP" ? ofWebp(bytes) : ofBoxes(bytes);
    if (!found) return null;
    const exif = nameAt(found, 0) === "Exif" ? found.subarray(6) : found;
    if (!/^(II|MM)/.test(nameAt(exif, 0))) return null;
    return format === "WebP" ? exif : upright(exif);
  } catch (error) {
    // Offsets that leave the file.
    if (error instanceof RangeError) return null;
    throw error;
  }
};
