// Drives Debian's chromium for the tests of the dashboard. Modules are those that web/install.sh put under build/web.
'use strict';
const path = require('path');
const modules = process.env.SRNFD_WEB_MODULES ?? path.join(__dirname, '../../build/web/node_modules');
const puppeteer = require(path.join(modules, 'puppeteer-core'));

// A software renderer, so that WebGL is there without a graphics processor. As root chromium has no sandbox.
const ARGUMENTS = ['--enable-unsafe-swiftshader', '--use-angle=swiftshader', '--no-sandbox', '--disable-dev-shm-usage',
    '--disable-background-networking', '--disable-component-update', '--disable-extensions', '--no-first-run', '--mute-audio'];

// SRNFD_BROWSER=firefox drives Debian's firefox-esr instead, without what needs chromium's debugger. It has WebGL on a
// display only: xvfb-run.
const firefox = process.env.SRNFD_BROWSER === 'firefox';
const PREFERENCES = { 'webgl.force-enabled': true, 'webgl.forbid-software': false, 'webgl.out-of-process': false };

async function launch(options = {}) {
    if (firefox) {
        return puppeteer.launch({
            browser: 'firefox', executablePath: process.env.FIREFOX ?? '/usr/bin/firefox-esr', headless: !process.env.DISPLAY, timeout: 60000,
            protocolTimeout: 900000, extraPrefsFirefox: PREFERENCES, ...options,
        });
    }
    return puppeteer.launch({
        executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', headless: true, args: ARGUMENTS, timeout: 60000,
        protocolTimeout: 900000, ...options,
    });
}

// A page that notes what it must not do: errors, words of the policy, requests to other hosts.
async function open(browser, url, { width = 1280, height = 900, dark = false } = {}) {
    const page = await browser.newPage();
    const found = [];
    const failed = []; // requests that were not answered, for whoever looks for the reason of something else
    page.setDefaultTimeout(Number(process.env.SRNFD_WEB_TIMEOUT ?? 30000));
    page.on('console', (message) => {
        if (message.type() === 'error' && !/Failed to load resource/.test(message.text())) found.push(message.text());
    });
    page.on('pageerror', (error) => found.push(`${error.stack ?? error}`));
    page.on('requestfailed', (request) => failed.push(`${request.method()} ${request.url()} ${request.failure()?.errorText}`));
    page.on('request', (request) => {
        const to = request.url();
        if (!to.startsWith(new URL(url).origin) && !/^(data|blob):/.test(to)) found.push(`a request to ${to}`);
    });
    await page.setViewport({ width, height });
    if (!firefox) await page.emulateMediaFeatures([{ name: 'prefers-color-scheme', value: dark ? 'dark' : 'light' }]);
    await page.goto(url, { waitUntil: 'load' });
    return { page, found, failed };
}

const text = (page, selector = 'main') => page.$eval(selector, (node) => node.innerText);
const waitText = (page, pattern, timeout) =>
    page.waitForFunction((p) => new RegExp(p).test(document.body.innerText), timeout ? { timeout } : {}, pattern.source ?? pattern);

async function press(page, label, again = 3) {
    const handle = await page.waitForFunction((wanted) => [...document.querySelectorAll('button, a, summary')]
        .find((node) => (node.getAttribute('aria-label') ?? node.textContent).trim() === wanted || node.textContent.trim() === wanted), {}, label);
    try {
        await handle.evaluate((node) => node.scrollIntoView({ block: 'center' })); // not under the tray
        await handle.asElement().click();
    } catch (error) {
        // A list that was drawn anew meanwhile has another node for it.
        if (again === 0 || !/detached/.test(error.message)) throw error;
        await press(page, label, again - 1);
    }
}

const visit = async (page, hash) => {
    await page.evaluate((h) => { location.hash = h; }, hash);
    await page.waitForFunction(() => document.querySelector('main h1') && !document.querySelector('main [aria-busy=true]'));
};

// Seconds of processor time that scripts, styles and layout of a page took so far.
async function meter(page) {
    const session = await page.createCDPSession();
    await session.send('Performance.enable', { timeDomain: 'threadTicks' });
    return async () => {
        const { metrics } = await session.send('Performance.getMetrics');
        return metrics.filter((m) => /^(Script|Layout|RecalcStyle)Duration$/.test(m.name)).reduce((sum, m) => sum + m.value, 0);
    };
}

module.exports = { firefox, meter, launch, open, text, waitText, press, visit, modules };
