//! Generated from the core's table of parameters by its test `parameter_documents`.

/// Parameters of a stylizer by number, the same as on the link. Every value is a `float`.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum GestusParameter {
    /// Neighbors of each class that the local models are fitted to. More of them average more: the output is smoother,
    /// but all steps look alike. Fewer follow the input more closely and are rougher; 40 is the value of Xia 2015. At
    /// most the stylizer's `K`, with every method, though only the mixture uses neighbors. 1 to 64. Default 8.
    K = 0,
    /// Weight λ of the ridge (Xia 2015, section 5.1). Less lets a class's slopes count more, and the output may take
    /// longer to forget an error; from about 1 on raw variables it is the neighbors' mean. 0.000000001 to 1000000.
    /// Default 0.1.
    Lambda = 1,
    /// Variables of the ridge. `norm` is better for motion that was recorded or made in pairs. Set λ and the feedback
    /// penalty together with it, as `Config::normalised` does. 0 raw, 1 norm. Default 0.
    Ridge = 2,
    /// Width δ of the mixing kernel (Xia 2015, eq. 4). Wider mixes more classes, costs more and blurs the action; Xia
    /// 2015 has 0.7. 0.001 to 1000. Default 0.2.
    Delta = 3,
    /// Weight of the classes that may be dropped from a frame's mixture. More is faster, and joints may jump where a
    /// class comes or goes. 0 to 0.99999994. Default 0.1.
    Prune = 4,
    /// Most classes in a frame's mixture, which bounds the slowest frame. A frame in which this drops more weight than
    /// `prune` allows sets the flag `classes`. 1 to 8. Default 4.
    Classes = 5,
    /// Half width κ of the interval about the neighbors' mean inside which the input is trusted, in standard deviations
    /// of the neighbors (Xia 2015, eq. 6). Wider passes less of an unusual gesture on to the output. 0 to 1000000.
    /// Default 0.25.
    Kappa = 6,
    /// Part ρ of what lies outside that interval that is kept in the output (Xia 2015, eq. 7). More keeps more of the
    /// input's own character, and is further from the style. 0 to 1. Default 0.7.
    Rho = 7,
    /// Most distances computed in a class and frame: what bounds the slowest frame. Fewer lose neighbors where the
    /// stream jumps; a frame that reaches the cap sets the flag `visits`. 64 to 448. Default 256.
    Visits = 8,
    /// Frames that the search keeps as candidates; at least `k` are kept. More find more of the true neighbors and
    /// visit more. 1 to 64. Default 20.
    Pool = 9,
    /// The search of a class restarts where its mean squared distance is this many times the last frame's. Lower
    /// notices a jump sooner, and restarts more often without need. 1 to 1000000000. Default 4.
    Jump = 10,
    /// Policy for the output's time. `free` is for files; a robot that takes a pose each tick wants `sync`. 0 free, 1
    /// sync. Default 0.
    Timing = 11,
    /// Width of the kernel that predicts the time step, in mean squared distances of the neighbors (Xia 2015, section
    /// 5.1). Wider averages more: time steps vary less. 0.001 to 1000. Default 0.5.
    TimingWidth = 12,
    /// Where the output's heading comes from. A predicted heading drifts from the input's in turns. 0 input, 1
    /// predicted. Default 0.
    Yaw = 13,
    /// kc: how far a linear model is trusted, in standard deviations of its inputs (Hsu 2005, eq. 8). One of some sixty
    /// dofs is always two or three deviations out, so a smaller value makes the model visibly come and go. 0.001 to
    /// 1000000. Default 5.
    Confidence = 14,
    /// kp: how sharply a linear model gives way to the input beyond kc (Hsu 2005, eq. 8). A large value switches; a
    /// small one mixes the input in everywhere. 0.001 to 1000. Default 8.
    Preference = 15,
    /// Half-life of the input's running statistics in statistical transfer, seconds; 0 takes those of the database.
    /// Short ones follow a performer that differs from the database, and forget slow motion. 0 to 1000000. Default 0.
    Halflife = 16,
    /// The method of translation. The database has to hold what it needs. A change restarts the stream. 0 mar, 1 lti, 2
    /// statistic, 3 phase. Default 0.
    Method = 17,
    /// Whether standing feet are held in place. Otherwise they slide at 12 to 18 cm/s. 0 no, 1 yes. Default 1.
    Contacts = 18,
    /// What the output does where the input is late, out of order, invalid, or leaps. A robot wants `hold` or `rest`. 0
    /// follow, 1 hold, 2 rest. Default 0.
    Safety = 19,
    /// Distance from its predicted place beyond which a held foot takes a step, metres. With less, feet step more
    /// often; more stretches legs. 0.01 to 1. Default 0.2.
    Release = 20,
    /// Shortest time in which a foot that leaves the floor returns to where the prediction has it, seconds. A shorter
    /// time shows as a jerk, a longer one drags the foot. 0.01 to 2. Default 0.2.
    Ease = 21,
    /// Penalty on the coefficient of the last output, as a multiple of λ; 1 in Xia 2015. More forgets an error sooner
    /// at a small λ, and makes the output rougher. 0.001 to 1000000. Default 1.
    Feedback = 22,
    /// How fast a joint of the output may turn, in multiples of the input's fastest joint of the last seconds; 0 sets
    /// no limit. A quicker style may turn joints as fast as its clips do, up to 5/3 of this limit. Lower holds quick
    /// styles back: their feet slide, and their arms do not rise as high. 1 to 100, or 0 for none. Default 1.2.
    SpeedLimit = 23,
    /// Half width κy of the interval about the neighbors' mean that an output stays in, in standard deviations of the
    /// dof over the database; Xia 2015 has none. A wider one lets an output that is fed back drift away from every
    /// example. 0 to 1000000. Default 0.25.
    OutputKappa = 24,
    /// A body stands where its fastest joint turns slower than this, rad/s, and its root moves by less than 0.2 m times
    /// that a second; the output then stands too. With 0 it never does: the output of a held pose may glide on. A
    /// larger value stops slow motion of the style, a smaller one takes sensor noise for motion. 0.001 to 1, or 0 for
    /// none. Default 0.1.
    StillSpeed = 25,
    /// Input whose mean squared distance is more than this many times that of the clips that the builder held out, or
    /// whose root goes much faster or slower than theirs, is unlike the database. It is passed through unchanged: in
    /// part from this value on, entirely from 1.5 times it on. The flag `far` is set where at least half is passed
    /// through. In the first half second of a stream the limit is 2.5 times this value, and the speed does not count. 0
    /// gives every input the style. Less also passes unusual motion of known actions through, more gives unknown
    /// actions a style that spoils them. 1 to 100, or 0 for none. Default 6.
    Trust = 26,
    /// How much the output's cycles differ, as a multiple of what ρ keeps of the input's own character, scaled by the
    /// variability of the style's clips over that of the clips of the input's style. Less is nearer to the style's
    /// mean, more is livelier and further from any one clip. 0 keeps ρ in every style, as Xia 2015 does. 0.01 to 4, or
    /// 0 for none. Default 0.
    Liveliness = 27,
    /// Time in which the output settles on the prediction, seconds, so that it does not jump where other neighbors or
    /// classes take part. Meanwhile the mixture's output moves as those of its neighbors move, so it does not lag. The
    /// output of phase tables has no neighbors to follow, so it settles in half of the time. A gait that has all the
    /// weight takes a quarter of the time. The time is longer where the body jumps to another part of a clip, begins
    /// another action, or where clips of another gesture come to take part. With linear models, only the part of the
    /// input that is blended in settles. More is smoother, and takes longer to follow a change; 0 outputs the
    /// prediction as it is, as Xia 2015 and Hsu 2005 do. 0.01 to 10, or 0 for none. Default 0.1.
    Settle = 28,
    /// In clips of a whole action, the frames that follow the last neighbors are preferred to the nearest frames. They
    /// may be farther away, by this multiple of the distance of the clips that the builder held out. They keep apart
    /// the repetitions of a wave, whose outputs cancel otherwise; where a motion repeats itself, all come from one
    /// clip. More keeps to the order of the clips, and is slower to notice that the body is elsewhere in them; less
    /// flattens waves. 0 takes the nearest frames, as Xia 2015 does. 0.01 to 100, or 0 for none. Default 1.
    Follow = 29,
    /// How far an output may turn a joint beyond where any captured frame of the database has it, radians along each
    /// axis, unless the input goes that way too. 0 sets no limit: elbows may bend backwards. More gives a strength
    /// above 1 more room, less holds back styles of bodies that are more flexible than the database's. 0.001 to 10, or
    /// 0 for none. Default 0.05.
    JointMargin = 30,
}
