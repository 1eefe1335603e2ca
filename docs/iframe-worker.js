/* Pages opened from a disk (file:) may not start a worker: there the search runs in a hidden frame instead.
   Served over http nothing is changed. */
if (location.protocol === "file:") {
  window.IFrameWorker = class extends EventTarget {
    constructor(url) {
      super()
      this.waiting = []
      const frame = document.createElement("iframe")
      frame.hidden = true
      frame.srcdoc = `<script>self.postMessage = (data) => self.told(data)</` +
        `script><script src="${url}"></` + `script>`
      frame.addEventListener("load", () => {
        this.scope = frame.contentWindow
        this.scope.told = (data) => {
          const event = new MessageEvent("message", { data })
          this.dispatchEvent(event)
          if (this.onmessage) this.onmessage(event)
        }
        this.waiting.splice(0).forEach((data) => this.postMessage(data))
      })
      const place = () => document.body.append(frame)
      document.body ? place() : document.addEventListener("DOMContentLoaded", place)
    }
    postMessage(data) {
      if (this.scope) this.scope.dispatchEvent(new MessageEvent("message", { data }))
      else this.waiting.push(data)
    }
    terminate() {}
  }
  window.Worker = window.IFrameWorker
}
