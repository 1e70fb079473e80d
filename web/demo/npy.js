// Boxes from a file of NumPy.

/** Float32Array with six numbers per box: lower x, y, z, upper x, y, z. Throws an Error that says what is wrong. */
export function boxesOfNpy(data) {
  const bytes = new Uint8Array(data);
  const magic = [0x93, 0x4e, 0x55, 0x4d, 0x50, 0x59];
  if (!magic.every((byte, k) => bytes[k] === byte)) {
    throw new Error('this is no .npy file; write one by numpy.save("boxes.npy", boxes)');
  }
  const view = new DataView(data);
  const isLong = bytes[6] >= 2;
  const start = isLong ? 12 : 10;
  if (bytes.length < start) throw new Error('the file ends in its header; save it again');
  const length = isLong ? view.getUint32(8, true) : view.getUint16(8, true);
  if (bytes.length < start + length) throw new Error('the file ends in its header; save it again');
  const header = new TextDecoder('latin1').decode(bytes.subarray(start, start + length));
  const type = /'descr':\s*'([^']*)'/.exec(header)?.[1];
  if (type !== '<f4') {
    throw new Error(`the file has the type ${type ?? 'of a structure'}, wanted float32: save boxes.astype("float32")`);
  }
  if (!/'fortran_order':\s*False/.test(header)) {
    throw new Error('the file is in Fortran order; save numpy.ascontiguousarray(boxes)');
  }
  const shape = (/'shape':\s*\(([^)]*)\)/.exec(header)?.[1] ?? '').split(',').filter((part) => part.trim()).map(Number);
  const isFlat = shape.length === 2 && shape[1] === 6;
  const isCorners = shape.length === 3 && shape[1] === 2 && shape[2] === 3;
  if ((!isFlat && !isCorners) || !(Number.isInteger(shape[0]) && shape[0] >= 0)) throw new Error(`the file has the shape (${shape.join(', ')}), wanted (n, 6) or (n, 2, 3)`);
  const count = 6 * shape[0];
  if (bytes.length < start + length + 4 * count) throw new Error('the file is shorter than its shape says; save it again');
  return new Float32Array(data.slice(start + length, start + length + 4 * count));
}
