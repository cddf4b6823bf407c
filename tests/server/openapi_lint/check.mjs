// node check.mjs FILE: exits with 1, and says why, if the file is no OpenAPI 3.1 document; or if the validator finds nothing in a bad one.
import { readFileSync } from 'node:fs';
import { Validator } from '@seriousme/openapi-schema-validator';

const document = JSON.parse(readFileSync(process.argv[2], 'utf8'));
const validator = new Validator();
const result = await validator.validate(structuredClone(document));
if (!result.valid) {
  console.error(JSON.stringify(result.errors, null, 1));
  process.exit(1);
}
if ((await new Validator().validate({ ...document, info: {} })).valid) {
  console.error('the validator accepts a document without a title');
  process.exit(1);
}
console.log(`OpenAPI ${validator.version}: ${Object.keys(document.paths).length} paths`);
