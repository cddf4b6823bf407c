// Jobs as deploy/kubernetes/jobs.py writes them, against the schemas of Kubernetes: node kubernetes.mjs jobs.yaml
import fs from 'node:fs';
import { Job } from 'kubernetes-models/batch/v1';

const documents = fs.readFileSync(process.argv[2], 'utf8').split('\n---\n').map((text) => JSON.parse(text));
if (documents.length < 3) throw new Error(`only ${documents.length} Jobs`);
for (const document of documents) new Job(document).validate();

// What the schema must refuse: else it would have looked at nothing.
for (const spoil of [
  (job) => { job.spec.completions = 'many'; },
  (job) => { delete job.spec.template; },
  (job) => { delete job.spec.template.spec.containers[0].name; },
  (job) => { job.spec.podFailurePolicy.rules[1].onExitCodes.values = ['75']; },
]) {
  const broken = structuredClone(documents[0]);
  spoil(broken);
  let refused = false;
  try { new Job(broken).validate(); } catch { refused = true; }
  if (!refused) throw new Error(`the schema takes a Job that is spoilt by ${spoil}`);
}
// Schemas let unknown names pass; these are all that a Job of ours uses.
const known = new Set(['suspend', 'completionMode', 'completions', 'parallelism', 'backoffLimitPerIndex', 'maxFailedIndexes', 'podFailurePolicy', 'template']);
const types = fs.readFileSync(new URL('./node_modules/kubernetes-models/batch/v1/JobSpec.d.ts', import.meta.url), 'utf8');
for (const { spec } of documents) {
  for (const name of Object.keys(spec)) {
    if (!known.has(name) || !new RegExp(`"?${name}"?\\??:`).test(types)) throw new Error(`a Job has no ${name}`);
  }
}
console.log(`${documents.length} Jobs are valid`);
