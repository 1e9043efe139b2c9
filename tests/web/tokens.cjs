// node tokens.cjs URL USER-FILE VIEWER-FILE: a service with tokens, behind a proxy that adds a prefix.
'use strict';
const fs = require('fs');
const http = require('http');
const path = require('path');
const { launch, open, text, waitText, press, visit } = require('./browser.cjs');
const { step, tell, failures } = require('./steps.cjs');

const [url, ...files] = process.argv.slice(2);
const [user, viewer] = files.map((file) => fs.readFileSync(file, 'utf8').trim());
const PREFIX = '/shapes/of/ours';

function proxy() {
    const to = new URL(url);
    const server = http.createServer((request, response) => {
        if (!request.url.startsWith(`${PREFIX}/`)) {
            response.writeHead(404).end();
            return;
        }
        const options = { host: to.hostname, port: to.port, method: request.method, path: request.url.slice(PREFIX.length), headers: { ...request.headers, connection: 'close' }, agent: false };
        request.pipe(http.request(options, (answer) => {
            response.writeHead(answer.statusCode, answer.headers);
            answer.pipe(response);
        }).on('error', (error) => {
            process.stdout.write(`note\tproxy: ${request.method} ${request.url} ${error.message}\t\n`);
            response.destroy();
        }));
    });
    return new Promise((resolve) => server.listen(0, '127.0.0.1', () => resolve(server)));
}

async function enter(page, secret) {
    const field = await page.waitForSelector('input[type=password]');
    await field.evaluate((node) => { node.value = ''; });
    await field.type(secret);
    await press(page, 'Use this token');
}

async function main() {
    const server = await proxy();
    const base = `http://127.0.0.1:${server.address().port}${PREFIX}`;
    const browser = await launch();
    const { page, found, failed } = await open(browser, `${base}/ui`);
    await step('behind a prefix the page is found, and asks for a token', async () => {
        try {
            await waitText(page, 'This service asks for a token');
        } catch (error) {
            return `${page.url()} ${await text(page, 'body')} ${error.message}`;
        }
    });
    await step('a wrong token is refused in words', async () => {
        await enter(page, 'srnfd_wrong');
        await waitText(page, 'not known here');
    });
    await step('a right one opens it', async () => {
        await enter(page, user);
        await waitText(page, 'Start a study');
    });
    await step('it is in no address, and not kept beyond the tab', () =>
        page.evaluate((secret) => !location.href.includes(secret) && !Object.values(localStorage).join().includes(secret) && document.cookie === '', user));
    await step('files are uploaded behind the prefix', async () => {
        await (await page.$('input[type=file]')).uploadFile(...['L', 'R'].map((side) => path.join(__dirname, `../data/aal_subcortex/${side}_thalamus.ply`)));
        await waitText(page, '2 of 2 files').catch(async (error) => { throw new Error(`${error.message}: ${failed.join(' | ')} ${await text(page)}`); });
        await visit(page, '#/meshes');
        await press(page, 'New cohort of 2');
        await waitText(page, '2 members');
    });
    await step('a reload keeps the token of the tab', async () => {
        await page.reload();
        await waitText(page, '2 members');
    });
    await step('a link that asks for a token shows its view after it', async () => {
        const other = await browser.newPage(); // the token is that of a tab
        await other.goto(`${base}/ui/#/meshes?find=R_thal`);
        await enter(other, user);
        await waitText(other, 'R_thalamus');
        const [address, said] = [other.url(), await text(other)];
        await other.close();
        return (address.endsWith('#/meshes?find=R_thal') && !said.includes('L_thalamus')) || `${address} ${said}`;
    });
    await step('a viewer sees the same, and nothing to change it by', async () => {
        await visit(page, '#/settings');
        await press(page, 'Forget the token');
        await enter(page, viewer);
        await waitText(page, 'Studies');
        for (const hash of ['#/', '#/meshes', '#/cohorts', '#/cohorts/cohort', '#/jobs']) {
            await visit(page, hash);
            await page.waitForFunction(() => document.querySelector('main h1'));
            const buttons = await page.$$eval('main button, .tray button', (all) => all.map((b) => b.textContent.trim()));
            const change = buttons.filter((b) => /Choose files|Choose a folder|Delete|New cohort|Save|Paste|Repair|Cancel|Load the example|Remove|Choose all/.test(b));
            if (change.length) return `${hash}: ${change.join(', ')}`;
            if (await page.$('main .drop, main input.cell, main input[type=checkbox]:not([disabled])')) return `${hash}: something to drop on or to edit`;
        }
        await visit(page, '#/analyses/mean');
        await waitText(page, 'A viewer may not start analyses');
    });
    tell(found.length === 0, 'no error, no word of the policy, no request to another host', found.join(' | '));
    await browser.close();
    process.exit(failures() ? 1 : 0); // streams through the proxy may still be open
}
main().catch((error) => { console.error(error); process.exit(1); });
