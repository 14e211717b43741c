// SPDX-License-Identifier: Apache-2.0
// Watches where the controls of the page stand, frame by frame, and lets a test change what arrives from the server.
// Loaded before the page's own scripts.
(() => {
  const CONTROLS = "button, input, select, a.button", MOVE_MAX = 0.5; // px
  let places = new Map(), moved = new Map(), samples = 0;

  const name = (control) => control.id || control.name || control.textContent;

  function place(control) {
    const { x, y, width, height } = control.getBoundingClientRect();
    return [x, y, width, height];
  }

  // A control that is hidden keeps the place at which it was seen last. One that another has replaced has lost its press.
  function look() {
    const now = [...document.querySelectorAll(CONTROLS)].filter((control) => control.getClientRects().length);
    for (const control of now) {
      const at = place(control), before = places.get(control);
      if (before?.some((one, k) => Math.abs(one - at[k]) > MOVE_MAX)) moved.set(name(control), `${before} to ${at}`);
      places.set(control, at);
    }
    for (const control of places.keys()) if (!control.isConnected) moved.set(name(control), "replaced");
    samples++;
    requestAnimationFrame(look);
  }

  window.still = {
    tamper: null, // changes a message of the server
    hello: null,
    begin() { places = new Map(); moved = new Map(); samples = 0; },
    found: () => ({ samples, controls: places.size, moved: [...moved].map(([control, how]) => `${control}: ${how}`) }),
  };
  window.WebSocket = class extends WebSocket {
    set onmessage(receive) {
      super.onmessage = ({ data }) => {
        const message = JSON.parse(data);
        if (message.type === "hello") window.still.hello = message;
        receive({ data: JSON.stringify(window.still.tamper?.(message) ?? message) });
      };
    }
  };
  requestAnimationFrame(look);
})();
