// A page that is opened from a folder may start no worker; the search then runs in a frame of its own instead.
if (location.protocol === "file:") {
  window.Worker = class extends EventTarget {
    constructor(url) {
      super()
      const frame = document.createElement("iframe")
      frame.hidden = true
      document.body.append(frame)
      const inside = frame.contentWindow
      inside.postMessage = data => {
        const event = new MessageEvent("message", { data })
        this.dispatchEvent(event)
        if (this.onmessage) this.onmessage(event)
      }
      const load = address => new Promise((done, failed) => {
        const script = frame.contentDocument.createElement("script")
        script.src = new URL(address, location.href)
        script.onload = done
        script.onerror = failed
        frame.contentDocument.body.append(script)
      })
      inside.importScripts = async (...addresses) => { for (const address of addresses) await load(address) }
      this.inside = inside
      this.loaded = load(url)
    }

    postMessage(data) {
      this.loaded.then(() => this.inside.dispatchEvent(new MessageEvent("message", { data })))
    }

    terminate() {
      this.inside.frameElement.remove()
    }
  }
}
