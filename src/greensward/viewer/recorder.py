"""What is made of what is seen: pictures of any size, a video, the way that was gone, and going it again."""

from pathlib import Path

from greensward.io.camera_path import CameraPath
from greensward.io.rasters import check_writable
from greensward.io.video import check_video, find_ffmpeg
from greensward.scene import Camera, GreenswardError, InputError
from greensward.viewer.jobs import VIDEO_FPS, PathRecorder, PictureJob, VideoJob
from greensward.viewer.pane import Pane
from greensward.viewer.saving import free_name
from greensward.viewer.session import Session

_LONGEST_S = 0.25


class Recorder:
    """Pictures that are drawn, and what is recorded, of a session."""

    def __init__(self, session: Session) -> None:
        self._session = session
        self._pictures: list[PictureJob] = []
        self._video: VideoJob | None = None
        self._way: PathRecorder | None = None
        self._track: CameraPath | None = None
        self._playing_s: float | None = None

    @property
    def folder(self) -> Path:
        """Where files go."""
        file = self._session.origin.file
        return file.parent if file else Path()

    @property
    def films(self) -> bool:
        """Whether a video is being recorded, whose pictures keep their size."""
        return self._video is not None

    def free_name(self, suffix: str) -> Path:
        """A file that is not there yet, nor about to be."""
        return free_name(self.folder, self._session.origin.name, suffix, [job.path for job in self._pictures])

    def draw(self, camera: Camera, path: Path, size: tuple[int, int], samples: int) -> bool:
        """Begin a picture of what is seen now; returns whether it can be written."""
        session = self._session
        try:
            check_writable(path)
            if any(job.path == path for job in self._pictures):
                raise InputError(f"{path}: is being drawn; wait for it, or choose another name")
        except GreenswardError as error:
            session.tell(str(error), bad=True)
            return False
        self._pictures.append(PictureJob(session.scene, camera, session.clock.time_s, path, size, samples))
        return True

    def toggle_way(self) -> None:
        """Record the way from now on, or stop and write it."""
        if self._way is None:
            self._way = PathRecorder()
            return
        stations = self._way.stations
        if len(stations) < 2:
            self._way = None
            return
        path = free_name(self.folder, f"{self._session.origin.name}-path", ".toml")
        try:
            self._track = CameraPath.recorded(stations)
            self._track.write(path)
        except GreenswardError as error:
            self._session.tell(f"{error}; the way is still being recorded", bad=True)
        else:
            self._way = None
            self._session.tell(f"Saved {path}. F7 goes it again; `greensward animate --camera-path` makes a clip")

    def toggle_playing(self) -> None:
        """Go the recorded way again, or stop."""
        if self._track is None:
            self._session.tell("Record a way first. F5")
            return
        self._playing_s = None if self._playing_s is not None else 0.0

    def play(self, seconds: float) -> None:
        """Go on along the recorded way, if it is being gone."""
        if self._track is None or self._playing_s is None:
            return
        self._playing_s += min(seconds, _LONGEST_S)
        self._session.walker.look_from(self._track.at(self._playing_s, self._session.scene.camera))
        if self._playing_s > self._track.end_s:
            self._playing_s = None

    def toggle_video(self, pane: Pane) -> None:
        """Record what a pane shows from now on, or stop."""
        if self._video is not None:
            self._stop_video()
            return
        if pane.picture is None:
            return
        width, height = pane.picture[1]
        size = max(width // 2 * 2, 2), max(height // 2 * 2, 2)  # as encoders want it
        path = self.free_name(".mp4")
        try:
            find_ffmpeg()
            check_video(path, size, VIDEO_FPS, None)
            self._video = VideoJob(path, size)
        except GreenswardError as error:
            self._session.tell(str(error), bad=True)

    def _stop_video(self) -> None:
        video, self._video = self._video, None
        assert video
        try:
            video.finish()
        except GreenswardError as error:
            self._session.tell(str(error), bad=True)
        else:
            self._session.tell(f"Saved {video.path}, {video.seconds:.1f} s")

    def take(self, camera: Camera, pane: Pane, seconds: float) -> None:
        """So much time has passed, and this is seen now."""
        if self._way is not None:
            self._way.add(camera, seconds)
        if self._video is not None:
            try:
                self._video.add(pane.read, seconds)
            except GreenswardError as error:
                self._session.tell(str(error), bad=True)
                self._video.give_up()
                self._video = None
        for job in [job for job in self._pictures if not job.running]:
            self._pictures.remove(job)
            self._session.tell(job.problem or f"Saved {job.path}", bad=job.problem is not None)

    @property
    def running(self) -> set[str]:
        """Names of actions that are under way."""
        recording = {"record_path": self._way, "record_video": self._video, "play_path": self._playing_s}
        return {name for name, on in recording.items() if on is not None}

    @property
    def working(self) -> list[str]:
        """What goes on, in words."""
        told = [f"{job.path.name}: {job.done} of {job.total} samples" for job in self._pictures]
        if self._video is not None:
            told.append(f"Recording a video, {self._video.seconds:.0f} s. F6 stops")
        if self._way is not None:
            told.append(f"Recording the way, {self._way.seconds:.0f} s. F5 stops")
        return told

    @property
    def would_be_lost(self) -> list[str]:
        """What leaving now would lose, in words."""
        told = [f"{job.path.name} is still being drawn." for job in self._pictures]
        told += ["The way that is being recorded is not saved."] if self._way else []
        return told + (["The video that is being recorded ends here."] if self._video else [])

    def stop(self) -> None:
        """End what goes on. Of a picture that is not there yet, nothing is written."""
        for job in self._pictures:
            job.stop()
        if self._video is not None:
            self._stop_video()
