// node compress.mjs FILE: writes FILE.br, whole or not at all.
import { readFileSync, renameSync, writeFileSync } from "node:fs";
import { brotliCompressSync, constants } from "node:zlib";

const kQuality = 10;  // 11, the highest, takes twice as long for a fiftieth of the bytes
const [, , file] = process.argv;
const plain = readFileSync(file);
const packed = brotliCompressSync(plain, {
  params: { [constants.BROTLI_PARAM_QUALITY]: kQuality, [constants.BROTLI_PARAM_SIZE_HINT]: plain.length },
});
writeFileSync(`${file}.part`, packed);
renameSync(`${file}.part`, `${file}.br`);
