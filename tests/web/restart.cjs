// node restart.cjs SRNFD FOLDER: the daemon is killed under an open page and comes back; ten thousand meshes are listed.
'use strict';
const { spawn } = require('child_process');
const { launch, meter, open, text, waitText, visit } = require('./browser.cjs');
const { step, tell, failures, note } = require('./steps.cjs');

const [program, folder] = process.argv.slice(2);
const MESHES = 10000;

function start(listen) {
    const child = spawn(program, ['serve', '--listen', listen, '--data', folder, '--workers', '1'], { stdio: ['ignore', 'ignore', 'pipe'] });
    return new Promise((resolve, reject) => {
        let log = '';
        child.stderr.on('data', (bytes) => {
            log += bytes;
            const said = /"event":"listening","address":"([^"]+)"/.exec(log);
            if (said) resolve({ child, address: said[1] });
        });
        child.on('exit', (code) => reject(new Error(`the daemon ended with ${code}: ${log.slice(-500)}`)));
    });
}
const stop = (child, signal) => new Promise((resolve) => {
    child.removeAllListeners('exit');
    child.on('exit', resolve);
    child.kill(signal);
});

async function main() {
    let daemon = await start('127.0.0.1:0');
    const { address } = daemon;
    const url = `http://${address}`;
    const browser = await launch();
    const { page, found } = await open(browser, `${url}/ui/`);
    await waitText(page, 'Start a study');
    await step('a daemon that died is told of', async () => {
        await stop(daemon.child, 'SIGKILL');
        await page.evaluate(() => { location.hash = '/meshes'; });
        await waitText(page, 'The service does not answer');
    });
    await step('and the page goes on when it is back', async () => {
        daemon = await start(address);
        await page.waitForFunction(() => !document.querySelector('.banner'), { timeout: 30000 });
        await visit(page, '#/settings');
        await waitText(page, '1 worker\\.');
    });

    let sent = 0;
    const sender = async () => {
        while (sent < MESHES) {
            const n = ++sent;
            const mesh = `OFF\n4 4 0\n0 0 0\n1 0 0\n0 1 0\n0 0 ${1 + n / 1000}\n3 0 2 1\n3 0 1 3\n3 1 2 3\n3 0 3 2\n`;
            const response = await fetch(`${url}/v1/meshes?name=mesh-${n}`, { method: 'POST', body: mesh });
            await response.arrayBuffer();
            if (!response.ok) throw new Error(`${response.status}`);
        }
    };
    await Promise.all([1, 2, 3, 4].map(sender));
    await step('ten thousand meshes are listed, with few rows in the page', async () => {
        await visit(page, '#/meshes');
        await page.waitForFunction((n) => document.querySelector('main table')?.getAttribute('aria-rowcount') === `${n + 1}`, { timeout: 120000 }, MESHES);
        const rows = await page.$$eval('main tbody tr', (all) => all.length);
        return rows < 80 || `${rows} rows`;
    });
    await step('sixty frames of scrolling are sixty frames of work', async () => {
        const spent = await meter(page);
        const before = await spent();
        await page.evaluate(async () => {
            const box = document.querySelector('.long');
            for (let i = 0; i < 60; i++) {
                box.scrollTop += 5000;
                await new Promise(requestAnimationFrame);
            }
        });
        const each = (1000 * ((await spent()) - before)) / 60;
        note(`script, style and layout: ${each.toFixed(1)} ms of the processor a frame`);
        return each < 16.7 || `${each} ms a frame`;
    });
    await step('one of them is found by its name', async () => {
        await page.type('input[type=search]', 'mesh-7777');
        await page.waitForFunction(() => document.querySelectorAll('main tbody tr').length === 1);
        return /mesh-7777/.test(await text(page));
    });
    const real = found.filter((f) => !/ERR_CONNECTION|net::/.test(f));
    tell(real.length === 0, 'no error and no word of the policy meanwhile', real.join(' | '));
    await browser.close();
    await stop(daemon.child, 'SIGTERM');
    process.exitCode = failures() ? 1 : 0;
}
main().catch((error) => { console.error(error); process.exit(1); });
