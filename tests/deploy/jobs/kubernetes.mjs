// Jobs as deploy/kubernetes/jobs.py writes them, against the schemas of Kubernetes: node kubernetes.mjs jobs.yaml
import fs from 'node:fs';
import { Job } from 'kubernetes-models/batch/v1';

// As kubectl reads it: what begins with a brace is JSON, of which it takes one document; else it goes by lines of three dashes.
const stream = fs.readFileSync(process.argv[2], 'utf8');
if (!stream.startsWith('---\n')) throw new Error('kubectl would take the stream for JSON');
const documents = `\n${stream}`.split('\n---\n').slice(1).map((text) => JSON.parse(text));
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
// A volume that is new belongs to root; publish needs room of its own.
const pods = documents.map(({ spec }) => spec.template.spec);
for (const pod of pods) {
  if (!(pod.securityContext?.fsGroup > 0)) throw new Error('tasks could not write into the volume');
}
const publish = pods.at(-1).containers[0];
const scratch = publish.env.find(({ name }) => name === 'TMPDIR')?.value;
const mount = publish.volumeMounts.find(({ mountPath }) => mountPath === scratch);
if (pods.at(-1).volumes.find(({ name }) => name === mount?.name)?.emptyDir?.sizeLimit !== '7Gi' || publish.resources.requests['ephemeral-storage'] !== '7Gi')
  throw new Error('publish has no scratch');
console.log(`${documents.length} Jobs are valid`);
