// Fifty names that would run, were they not text.
'use strict';
const TAGS = ['<script>hit=1</script>', '<img src=x onerror=hit=1>', '<svg onload=hit=1>', '"><b onmouseover=hit=1>', "'onfocus='hit=1' autofocus='",
    'javascript:hit=1', '<iframe srcdoc="<script>parent.hit=1</script>">', '{{constructor.constructor("hit=1")()}}', '<a href="javascript:hit=1">x</a>', '</title><script>hit=1</script>'];
const PAYLOADS = Array.from({ length: 50 }, (_, i) => `${i} ${TAGS[i % TAGS.length]}${i >= 10 ? `<!--${i}-->` : ''}`);

// Whether one of them ran, or became an element.
const ran = (page, within = 'main') => page.evaluate((root) => window.hit !== undefined
    || [...document.querySelectorAll(root)].some((node) => node.querySelector('img, iframe, script, b, a[href^=javascript], [onerror], [onload], [onmouseover], [onfocus]')), within);

// What a part of a page says: its text, hidden tables too, and what its attributes tell.
const told = (page, within = 'main') => page.$eval(within, (root) => [root.textContent, ...[...root.querySelectorAll('*')]
    .flatMap((node) => [...node.attributes].map((a) => a.value).concat(node.value ?? []))].join('\n').replace(/\s+/g, ' '));

// The payloads that it does not say.
const unsaid = async (page, within) => {
    const said = await told(page, within);
    return PAYLOADS.filter((payload) => !said.includes(payload.replace(/\s+/g, ' ')));
};

module.exports = { PAYLOADS, ran, unsaid };
