// Object storage on this host: node s3.mjs FOLDER PORT. What is stored is in FOLDER, and there again after a kill. A line a request.
import S3rver from 's3rver';
const [directory, port] = process.argv.slice(2);
const storage = new S3rver({ port: Number(port), address: '127.0.0.1', silent: true, directory, configureBuckets: [{ name: 'terrain' }] });
storage.middleware.unshift(async (ctx, next) => {
  await next();
  console.log(`${ctx.method} ${ctx.status} ${ctx.url.split('?')[0]} ${ctx.length ?? 0}`);
});
await storage.run();
console.log('ready');
