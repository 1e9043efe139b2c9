function s(t){return t.replace(/[aeiouyAEIOUY]/g,e=>e+e.toLowerCase()).padEnd(Math.ceil(1.4*t.length),"e")}var r=t=>t.replace(/\{\d+\}|\p{L}+/gu,n=>n.startsWith("{")?n:s(n));export{r as translate};
