/* Opens the page of the viewer in a headless browser, over the loopback alone, and uses it as its
   visitors do, through the browser's debugging pipe.
   Use: node tests/web.js FOLDER, where tests/web.sh has left the page, start.path and small.pgm; the
   page's picture goes to FOLDER/web.png, others beside it. */
'use strict';
const http = require('http'), fs = require('fs'), path = require('path'), os = require('os');
const { spawn } = require('child_process');

const folder = process.argv[2], site = path.join(__dirname, '..', 'build', 'web');
const browserName = process.env.CHROMIUM || 'chromium';
let passed = 0, failed = 0;

function check(name, ok, more) {
  if (ok) passed++;
  else { failed++; console.log(`FAILED ${name}${more === undefined ? '' : ': ' + more}`); }
}
const sleep = ms => new Promise(done => setTimeout(done, ms));

/* ---- A server for the page's own files */

const kinds = { '.html': 'text/html', '.js': 'text/javascript', '.wasm': 'application/wasm' };
const server = http.createServer((request, response) => {
  const name = new URL(request.url, 'http://x').pathname.replace(/^\/$/, '/index.html');
  fs.readFile(path.join(site, path.basename(name)), (error, data) => {
    response.writeHead(error ? 404 : 200, { 'content-type': kinds[path.extname(name)] || 'text/plain' });
    response.end(data);
  });
});

/* ---- The browser */

const errors = [], waiting = new Map();
let browser, session, count = 0;

function openBrowser(profile) {
  browser = spawn(browserName, ['--headless=new', '--no-sandbox', '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader', '--disable-dev-shm-usage', '--disable-extensions',
    '--disable-background-networking', '--disable-component-update', '--disable-sync', '--no-first-run',
    '--remote-debugging-pipe', `--user-data-dir=${profile}`, '--window-size=1000,800', 'about:blank'],
    { stdio: ['ignore', 'ignore', 'ignore', 'pipe', 'pipe'] });
  let rest = '';
  browser.stdio[4].on('data', data => {
    const parts = (rest + data).split('\0');
    rest = parts.pop();
    for (const part of parts) receive(JSON.parse(part));
  });
}

function receive(message) {
  if (message.id && waiting.has(message.id)) {
    waiting.get(message.id)(message);
    waiting.delete(message.id);
  } else if (message.method === 'Runtime.exceptionThrown') {
    const details = message.params.exceptionDetails;
    errors.push(details.exception && details.exception.description || details.text);
  } else if (message.method === 'Runtime.consoleAPICalled' && message.params.type === 'error') {
    errors.push(message.params.args.map(a => a.value || a.description).join(' '));
  } else if (message.method === 'Log.entryAdded' && message.params.entry.level === 'error') {
    errors.push(message.params.entry.text);
  }
}

function send(method, params = {}) {
  return new Promise((done, fail) => {
    const id = ++count;
    waiting.set(id, answer => answer.error ? fail(new Error(method + ': ' + answer.error.message))
                                           : done(answer.result));
    browser.stdio[3].write(JSON.stringify({ id, method, params, sessionId: session }) + '\0');
  });
}

async function run(expression) {
  const answer = await send('Runtime.evaluate', { expression, awaitPromise: true, returnByValue: true });
  if (answer.exceptionDetails)
    throw new Error(answer.exceptionDetails.exception.description + ' in ' + expression);
  return answer.result.value;
}

async function until(expression, seconds) {
  for (let i = 0; i < seconds * 20; i++) {
    if (await run(expression)) return true;
    await sleep(50);
  }
  return false;
}

/* ---- What a visitor does */

const figure = which => run(`window.Module && Module.calledRun ? Module._viewer_figure(${which}) : 0`);
const ready = seconds => until('!!(window.Module && Module.calledRun && Module._viewer_figure(0))', seconds);

/* The canvas as it is drawn now, also kept as a file. */
async function shot(name) {
  const url = await run(`call('frame'), canvas.toDataURL('image/png')`);
  fs.writeFileSync(path.join(folder, name), Buffer.from(url.split(',')[1], 'base64'));
  return url;
}

async function press(text) {
  const found = await run(`(() => { const b = [...document.querySelectorAll('button')]
    .find(b => b.textContent === ${JSON.stringify(text)}); if (b) b.click(); return !!b; })()`);
  check(`there is a button ${text}`, found);
  await sleep(400);
}

async function key(code, text, type) {
  await send('Input.dispatchKeyEvent', { type, code, key: text, windowsVirtualKeyCode: text.toUpperCase().charCodeAt(0) });
}

async function visit(address) {
  await send('Runtime.enable');
  await send('Log.enable');
  await send('Page.enable');
  const eye = fs.readFileSync(path.join(folder, 'start.path'), 'utf8').split('\n')[0].replace(/ /g, ',');
  await send('Page.navigate', { url: `${address}/?eye=${eye}&args=--size%20640x480%20--terrain-size%20513` });
  check('the page draws', await ready(60));
  await press('Figures');
  await sleep(1500);
  const first = await shot('web.png');

  for (const name of ['Wireframe', 'Levels', 'Atlas', 'Compare', 'Sea', 'Houses', 'Trees']) {
    await press(name);
    check(`${name} shows`, await shot(`web_${name.toLowerCase()}.png`) !== first);
    check(`${name} is said to be on`, await run(`[...document.querySelectorAll('button')]
      .find(b => b.textContent === '${name}').getAttribute('aria-pressed')`) === 'true');
    await press(name);
  }
  await press('Full mesh');
  check('a mode is chosen', await figure(5) === await run('Module._viewer_figure(5)') && await figure(1) > 0);
  const mode = await figure(5);
  await press('Auto');
  check('another mode is chosen', await figure(5) !== mode);
  await press('+ px');
  await press('\u2212 px');
  await press('Sun east');
  await press('Sun west');

  const x = await figure(6), z = await figure(7);
  await run('canvas.focus()');
  await key('KeyW', 'w', 'keyDown');
  await sleep(700);
  await key('KeyW', 'w', 'keyUp');
  await sleep(200);
  check('W flies', Math.hypot(await figure(6) - x, await figure(7) - z) > 1);
  const there = await figure(6);
  await sleep(300);
  check('and stops', await figure(6) === there);
  await run(`document.querySelector('#controls button').focus()`);
  await key('KeyW', 'w', 'keyDown');
  await sleep(300);
  await key('KeyW', 'w', 'keyUp');
  check('keys on a button do not fly', await figure(6) === there);

  const before = await shot('web_before.png');
  await run(`window.loser = Module.ctx.getExtension('WEBGL_lose_context'), loser.loseContext()`);
  check('a lost context is noted', await until(`!document.getElementById('note').hidden`, 5));
  await run('loser.restoreContext()');
  check('it comes back', await until(`document.getElementById('note').hidden`, 10) && await ready(10),
        await run('UTF8ToString(call("message"))'));
  await sleep(1500);
  const restored = await shot('web_restored.png');
  check('with its picture', restored.length > before.length * 0.9, `${restored.length} of ${before.length}`);

  await run(`openFile(new File([Uint8Array.from(atob('${
    fs.readFileSync(path.join(folder, 'small.pgm')).toString('base64')}'), c => c.charCodeAt(0))], 'small.pgm'))`);
  check('a file is shown', await until('Module._viewer_figure(4) === 120 && Module._viewer_figure(0)', 20));
  await run(`openFile(new File(['ncols 2'], 'bad.asc'))`);
  check('a bad file is named', await until(`document.getElementById('status').textContent.includes('bad.asc')`, 5));
  await run(`openFile(new File([Uint8Array.from(atob('${
    fs.readFileSync(path.join(folder, 'flyover.png')).toString('base64')}'), c => c.charCodeAt(0))], 'a.png'))`);
  check('a PNG is shown', await until('Module._viewer_figure(4) === 640 && Module._viewer_figure(0)', 30));
  check('controls have names', await run(`[...document.querySelectorAll('button,input,canvas')]
    .every(e => e.textContent.trim() || e.getAttribute('aria-label') || e.labels && e.labels[0])`));
}

/* The default terrain, at the size of the window, in light and dark. */
async function visitPlainly(address) {
  for (const theme of ['light', 'dark']) {
    await send('Emulation.setEmulatedMedia', { features: [{ name: 'prefers-color-scheme', value: theme }] });
    await send('Page.navigate', { url: address + '/' });
    const start = Date.now();
    check('the page draws over 1025 x 1025', await ready(60));
    console.log(`first picture over 1025 x 1025 after ${((Date.now() - start) / 1000).toFixed(1)} s`);
    await sleep(1500);
    const picture = await send('Page.captureScreenshot', { format: 'png' });
    fs.writeFileSync(path.join(folder, `page_${theme}.png`), Buffer.from(picture.data, 'base64'));
  }
}

(async () => {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'terrimp-web-'));
  try {
    await new Promise(done => server.listen(0, '127.0.0.1', done));
    openBrowser(profile);
    const address = `http://127.0.0.1:${server.address().port}`;
    const { targetId } = await send('Target.createTarget', { url: 'about:blank' });
    session = (await send('Target.attachToTarget', { targetId, flatten: true })).sessionId;
    await visit(address);
    await visitPlainly(address);
    check('the console is free of errors', errors.length === 0, errors.slice(0, 3).join(' | '));
  } catch (error) {
    check('the browser answers', false, error.message);
  }
  const gone = new Promise(done => browser.once('exit', done));
  browser.kill();
  await Promise.race([gone, sleep(5000)]);
  server.close();
  try {
    fs.rmSync(profile, { recursive: true, force: true, maxRetries: 5, retryDelay: 200 });
  } catch (error) { /* a process of the browser still writes there: it is of /tmp */ }
  console.log(`${passed} passed, ${failed} failed`);
  process.exit(failed ? 1 : 0);
})();
